//! Damaged, lying and odd files: a clear error or a correct read, never a panic, never the end of the process.
#![allow(clippy::unwrap_used, clippy::panic)]

use crate::frames_support;

use frames_support::*;
use satphot::fits::{CardValue, Header, write_u16, wrong_checksum};
use satphot::frames::mid_time;

/// Reads a whole file without caring what it is; the message of what went wrong.
fn try_read(path: &std::path::Path) -> Result<f64, String> {
    let header = Header::read(path).map_err(|e| e.to_string())?;
    let e = anything(path, header);
    read(&e, unit_gain(), None, None).map(|f| sum(&f)).map_err(|e| e.to_string())
}

/// What each file of astropy's test data is: the sum of its pixels by astropy 8.0.2, or a word of why it is refused.
const ODD_FILES: [(&str, Result<f64, &str>); 18] = [
    ("blank.fits", Ok(0.0)),
    ("checksum_false.fits", Ok(251_496.0)),
    ("comp.fits", Ok(34_417_871.0)),
    // one axis of 3 px: no picture
    ("compressed_float_bzero.fits", Err("has axes [3]")),
    ("defunct_keywords.hdr", Err("truncated: the header of HDU 0 promises")),
    ("fixed-1890.fits", Ok(18_900_000.0)),
    ("group_invalid.fits", Err("random groups")),
    ("header_newlines.fits", Ok(0.0)),
    ("header_with_time.fits", Err("SIMPLE is not T")),
    ("header_with_time_wcslib71.fits", Err("SIMPLE is not T")),
    ("history_header.fits", Err("no 2-D image")),
    ("invalid_header.hdr", Err("control characters")),
    ("irac_sip.hdr", Err("truncated: the header of HDU 0 promises")),
    ("nonstandard_units.hdr", Err("does not begin with SIMPLE")),
    ("scale.fits", Ok(223_202.765_441_894_53)),
    ("test0.fits", Ok(501_021.0)),
    // its first HDU is empty, its table no picture
    ("theap-gap.fits", Err("no 2-D image")),
    ("verify.fits", Err("where the standard requires BITPIX")),
];

#[test]
fn odd_files_of_astropy_are_read_right_or_refused_clearly() {
    let Some(bad) = shared("data/badfits") else { return };
    for (name, expected) in ODD_FILES {
        let got = try_read(&bad.join(name));
        println!("{name}: {got:?}");
        match (got, expected) {
            // f32 pixels
            (Ok(sum), Ok(total)) => assert!((sum - total).abs() <= 1e-7 * total.abs(), "{name}: {sum}"),
            (Err(message), Err(word)) => assert!(message.contains(word) && message.contains(name), "{name}: {message}"),
            (got, _) => panic!("{name}: {got:?}, expected {expected:?}"),
        }
    }
    // 0 x 777777701 px
    let zero = try_read(&bad.join("zerowidth.fits")).unwrap_err();
    assert!(zero.contains("has axes [777777701, 0]"), "{zero}");
    let sums = bad.join("checksum_false.fits");
    let message = wrong_checksum(&sums, &Header::read(&sums).unwrap()).unwrap().unwrap();
    assert!(message.contains("DATASUM"), "{message}");
}

#[test]
fn the_headers_of_eleven_programs_give_a_time_or_a_reason() {
    let Some(headers) = shared("data/headers") else { return };
    let mid = |name: &str, exptime_s: f64| {
        let bytes = std::fs::read(headers.join(name)).unwrap();
        let h = Header::from_text(&String::from_utf8_lossy(&bytes));
        let t = mid_time(&h, exptime_s, &Default::default(), &Default::default(), name.as_ref());
        (h, t.map(|t| (t.mid.to_string(), t.source)).map_err(|e| e.to_string()))
    };
    let expect = |name: &str, exptime_s: f64, utc: &str, source: &str| {
        let (h, t) = mid(name, exptime_s);
        let (got, from) = t.unwrap();
        assert!(got.starts_with(utc) && from == source, "{name}: {got} from {from}");
        h
    };
    let nina = expect("nina.txt", 30.0, "2021-03-02T20:19:15.455", "DATE-OBS + EXPTIME/2");
    assert_eq!((nina.integer("GAIN"), nina.size_px()), (Some(120), (4144, 2822)));
    expect("sharpcap.txt", 2.0, "2019-04-29T20:25:28.8219583", "DATE-OBS - EXPTIME/2 by its comment");
    let apt = expect("apt.txt", 240.0, "2018-09-17T21:06:46", "DATE-OBS + EXPTIME/2");
    assert_eq!(apt.text("HIERARCH CAMERA-DATE-OBS").as_deref(), Some("2018-09-17T21:04:46"));
    expect("maximdl.txt", 300.0, "2018-07-04T14:05:33", "DATE-OBS + EXPTIME/2");
    expect("sgp.txt", 30.0, "2020-05-30T00:23:04.096882", "DATE-OBS + EXPTIME/2");
    expect("seestar.txt", 10.0, "2025-05-13T22:48:40.751879", "DATE-OBS + EXPTIME/2");
    let pixinsight = expect("pixinsight.txt", 120.0, "2022-03-07T21:59:44.06", "(DATE-OBS + DATE-END)/2");
    assert_eq!((pixinsight.number("EXPTIME"), pixinsight.number("EGAIN")), (Some(120.0), Some(3.62)));
    for entry in std::fs::read_dir(&headers).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let (h, t) = mid(&name, 10.0);
        println!("{name}: {} cards, {t:?}", h.cards().len());
        assert!(h.cards().len() > 10, "{name}");
    }
}

#[test]
fn a_truncated_file_names_the_bytes_it_lacks() {
    let dir = tempfile::tempdir().unwrap();
    let whole = fits(16, 100, 100, &light(), &vec![0; 20_000]);
    let path = put(dir.path(), "cut.fits", &whole[..2880 + 12_345]);
    let e = try_read(&path).unwrap_err();
    assert!(e.contains("truncated") && e.contains("20000") && e.contains("12345"), "{e}");
    // Cut in the padding only: every pixel is there, and the observer is warned.
    let path = put(dir.path(), "padding.fits", &whole[..2880 + 20_000]);
    assert_eq!(try_read(&path), try_read(&put(dir.path(), "whole.fits", &whole)));
    assert!(Header::read(&path).unwrap().warnings()[0].contains("160 bytes are missing"));
    for block in 1..whole.len() / 2880 {
        let e = try_read(&put(dir.path(), "block.fits", &whole[..block * 2880])).unwrap_err();
        assert!(e.contains("truncated"), "{block}: {e}");
    }
    assert!(try_read(&put(dir.path(), "packed.fits", &[0x1f, 0x8b, 8, 0])).unwrap_err().contains("gzip stream"));
    let mut newline = image_cards(8, 1, 1, &light());
    newline.push("COMMENT two\nlines".into());
    let path = put(dir.path(), "newline.fits", &header(&newline));
    assert!(try_read(&path).unwrap_err().contains("control characters"));
    assert!(try_read(&put(dir.path(), "head.fits", &whole[..300])).unwrap_err().contains("END"));
    assert!(try_read(&put(dir.path(), "head.fits", &whole[..2000])).unwrap_err().contains("the file holds 0"));
    assert!(try_read(&put(dir.path(), "empty.fits", b"")).unwrap_err().contains("empty"));
    assert!(try_read(&put(dir.path(), "text.fits", b"hello")).unwrap_err().contains("not a FITS file"));
    assert!(try_read(&dir.path().join("absent.fits")).unwrap_err().contains("absent.fits"));
    assert!(try_read(dir.path()).is_err());
}

#[test]
fn a_header_that_lies_about_its_size_allocates_nothing() {
    let dir = tempfile::tempdir().unwrap();
    for (nx, ny) in [
        ("777777701", "2"),
        ("9223372036854775807", "9223372036854775807"),
        ("-5", "10"),
        ("1E3", "10"),
        ("2147483647", "2147483647"),
    ] {
        let cards = [card("SIMPLE", "T"), card("BITPIX", 16), card("NAXIS", 2), card("NAXIS1", nx), card("NAXIS2", ny)];
        let e = try_read(&put(dir.path(), "lie.fits", &header(&cards))).unwrap_err();
        assert!(e.contains("truncated") || e.contains("NAXIS"), "{nx}x{ny}: {e}");
    }
    for (bitpix, word) in [("17", "BITPIX = 17"), ("0", "BITPIX = 0"), ("'16'", "not a whole number")] {
        let cards = [card("SIMPLE", "T"), card("BITPIX", bitpix), card("NAXIS", 0)];
        assert!(try_read(&put(dir.path(), "lie.fits", &header(&cards))).unwrap_err().contains(word));
    }
}

/// A small Rice-compressed frame.
fn compressed() -> Vec<u8> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("c.fits");
    let pixels = ndarray::Array2::from_shape_fn((12, 40), |(j, i)| (j * 40 + i) as u16);
    let cards = [("EXPTIME".to_string(), CardValue::Real(5.0), String::new())];
    write_u16(&path, &pixels, &cards, true).unwrap();
    std::fs::read(&path).unwrap()
}

/// Replaces the value of a card.
fn with_value(mut bytes: Vec<u8>, key: &str, value: &str) -> Vec<u8> {
    let at = bytes.chunks(80).position(|c| c.starts_with(format!("{key:<8}=").as_bytes())).unwrap() * 80;
    bytes[at + 10..at + 80].copy_from_slice(format!("{value:>20}{:50}", "").as_bytes());
    bytes
}

#[test]
fn compressed_headers_that_would_kill_the_process_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let good = compressed();
    assert_eq!(try_read(&put(dir.path(), "good.fits.fz", &good)), Ok((480 * 479 / 2) as f64));
    for (key, value) in [
        ("ZTILE1", "0"),
        ("ZTILE2", "0"),
        ("ZTILE1", "-1"),
        ("ZNAXIS1", "0"),
        ("ZNAXIS1", "2147483647"),
        ("ZNAXIS", "9"),
        ("ZBITPIX", "13"),
        ("ZCMPTYPE", "'RICE_9  '"),
        ("TFORM1", "'12A    0'"),
        ("TFORM1", "'0'"),
        ("ZVAL1", "0"),
        ("NAXIS2", "3"),
        ("NAXIS1", "7"),
        ("PCOUNT", "-1"),
        ("TFIELDS", "2"),
        ("TFORM1", "'1PB(-3)'"),
    ] {
        let e = try_read(&put(dir.path(), "bad.fits.fz", &with_value(good.clone(), key, value)));
        assert!(e.is_err(), "{key} = {value} was accepted: {e:?}");
    }
}

#[test]
fn a_sparse_file_that_holds_what_its_header_promises_allocates_no_more_than_its_image() {
    let dir = tempfile::tempdir().unwrap();
    let sparse = |name: &str, bytes: &[u8]| {
        let path = put(dir.path(), name, bytes);
        std::fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(9_000_000_000).unwrap();
        path
    };
    let large = with_value(compressed(), "PCOUNT", "7000000000");
    // room alone is no fault
    assert_eq!(try_read(&sparse("room.fits.fz", &large)), Ok((480 * 479 / 2) as f64));
    // a tile of 2 GB: its length is the first number of its row of the table
    let end = large.windows(80).rposition(|card| card.starts_with(b"END ") && card[4..].iter().all(|b| *b == b' '));
    let table = (end.unwrap() + 80).next_multiple_of(2880);
    let mut tile = large.clone();
    tile[table..table + 4].copy_from_slice(&2_000_000_000_i32.to_be_bytes());
    let message = try_read(&sparse("tile.fits.fz", &tile)).unwrap_err();
    assert!(message.contains("2000000000 bytes") && message.contains("tile 1"), "{message}");
    // rows of the table of 100 MB
    let mut row = with_value(with_value(large, "TFIELDS", "2"), "NAXIS1", "100000008");
    let card = row.chunks(80).position(|card| card.starts_with(b"EXPTIME ")).unwrap() * 80;
    row[card..card + 8].copy_from_slice(b"TFORM2  ");
    let message = try_read(&sparse("row.fits.fz", &with_value(row, "TFORM2", "'100000000B'"))).unwrap_err();
    assert!(message.contains("the table of the tiles takes 1200000096 bytes"), "{message}");
}

#[test]
fn scalings_that_cannot_be_meant_are_refused_and_odd_ones_are_applied() {
    let dir = tempfile::tempdir().unwrap();
    let data: Vec<u8> = [3i16, -7, 20, 5].iter().flat_map(|v| v.to_be_bytes()).collect();
    let with = |cards: &[String]| {
        let more: Vec<String> = light().into_iter().chain(cards.iter().cloned()).collect();
        try_read(&put(dir.path(), "scaled.fits", &fits(16, 2, 2, &more, &data)))
    };
    for (cards, sum) in [
        (vec![], 21.0),
        (vec![card("BSCALE", -2)], -42.0),
        (vec![card("BZERO", "1.5D2")], 621.0),
        (vec![card("BLANK", 20), card("BZERO", 10)], 31.0),
        (vec![card("BSCALE", "1E-3"), card("BZERO", -1)], -3.979),
        // what overflows is undefined, never infinite
        (vec![card("BSCALE", "1E60")], 0.0),
    ] {
        let got = with(&cards).unwrap();
        assert!((got - sum).abs() < 1e-6, "{cards:?}: {got}");
    }
    for (cards, word) in [
        (vec![card("BSCALE", 0)], "BSCALE = 0"),
        (vec![text("BZERO", "high")], "BZERO = 'high' is not a number"),
        (vec![card("BSCALE", "NAN")], "BSCALE = 'NAN'"),
        (vec![card("BLANK", "2.5")], "BLANK = '2.5' is not a whole number"),
    ] {
        let e = with(&cards).unwrap_err();
        assert!(e.contains(word), "{cards:?}: {e}");
    }
    let mut accent = image_cards(16, 2, 2, &light());
    accent.push("COMMENT Meudon, l'?t?".into());
    let mut bytes = header(&accent);
    bytes.iter_mut().filter(|b| **b == b'?').for_each(|b| *b = 0xe9);
    bytes.extend(&data);
    bytes.resize(5760, 0);
    let path = put(dir.path(), "accent.fits", &bytes);
    assert_eq!(try_read(&path), Ok(21.0));
    assert!(Header::read(&path).unwrap().warnings()[0].contains("not ASCII"));
}
