//! Damaged, lying and odd files: a clear error or a correct read, never a panic, never the end of the process.
#![allow(clippy::unwrap_used)]

mod frames_support;

use std::sync::OnceLock;

use frames_support::*;
use rand::{Rng, SeedableRng};
use satphot::frames::{CardValue, Exposure, Header, classify, mid_time, write_u16};

/// Reads a whole file without caring what it is; the message of what went wrong.
fn try_read(path: &std::path::Path) -> Result<f64, String> {
    let header = Header::read(path).map_err(|e| e.to_string())?;
    static ANY: OnceLock<Exposure> = OnceLock::new();
    let any = ANY.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        exposure(&put(dir.path(), "x.fits", &fits(8, 1, 1, &light(), &[1])))
    });
    let mut e = any.clone();
    e.size_px = header.size_px();
    e.header = header;
    e.path = path.to_path_buf();
    read(&e, unit_gain(), None, None).map(|f| sum(&f)).map_err(|e| e.to_string())
}

#[test]
fn odd_files_of_astropy_are_read_right_or_refused_clearly() {
    let Some(bad) = shared("data/badfits") else { return };
    // Sums by astropy 8.0.2.
    for (name, total) in [
        ("blank", 0.0),
        ("checksum_false", 251496.0),
        ("comp", 34417871.0),
        ("fixed-1890", 18900000.0),
        ("header_newlines", 0.0),
        ("scale", 223202.76544189453),
        ("test0", 501021.0),
    ] {
        let got = try_read(&bad.join(format!("{name}.fits"))).unwrap();
        // f32 pixels.
        assert!((got - total).abs() <= 1e-7 * total.abs(), "{name}: {got}");
    }
    for (name, word) in [
        ("group_invalid", "random groups"),
        ("header_with_time", "SIMPLE is not T"),
        ("header_with_time_wcslib71", "SIMPLE is not T"),
        ("history_header", "no 2-D image"),
        ("theap-gap", "no 2-D image"),
        ("verify", "where the standard asks for BITPIX"),
        ("zerowidth", "no 2-D image"),
    ] {
        let e = try_read(&bad.join(format!("{name}.fits"))).unwrap_err();
        assert!(e.contains(word) && e.contains(name), "{name}: {e}");
    }
    for entry in std::fs::read_dir(&bad).unwrap() {
        let path = entry.unwrap().path();
        println!("{}: {:?}", path.file_name().unwrap().to_string_lossy(), try_read(&path));
    }
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
    // Cut in the padding only: every pixel is there, but the library wants whole blocks.
    let path = put(dir.path(), "padding.fits", &whole[..2880 + 20_000]);
    assert!(try_read(&path).unwrap_err().contains("2880"));
    let mut newline = image_cards(8, 1, 1, &light());
    newline.push("COMMENT two\nlines".into());
    let path = put(dir.path(), "newline.fits", &header(&newline));
    assert!(try_read(&path).unwrap_err().contains("control characters"));
    assert!(try_read(&put(dir.path(), "head.fits", &whole[..2000])).unwrap_err().contains("END"));
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
fn thousands_of_mutated_headers_never_panic() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(20_250_609);
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("fuzz.fits");
    let mut more = light();
    more.extend([card("BZERO", 32768), card("BSCALE", 1)]);
    let plain = fits(16, 20, 10, &more, &[7; 400]);
    let seeds = [(plain, 5), (compressed(), 60)];
    let (mut fine, mut refused) = (0, 0);
    for round in 0..3000 {
        let (mut bytes, cards) = seeds[round % 2].clone();
        for _ in 0..rng.random_range(1..4) {
            let card = rng.random_range(0..cards + 10);
            let at = (card * 80 + rng.random_range(0..32)).min(bytes.len() - 1);
            // One in five hits anywhere: descriptors and compressed bytes too.
            let at = if rng.random_range(0..5) == 0 { rng.random_range(0..bytes.len()) } else { at };
            bytes[at] = match rng.random_range(0..3) {
                0 => b"0123456789-+.ETF' ="[rng.random_range(0..19)],
                1 => rng.random_range(0x20..0x7f),
                _ => rng.random(),
            };
        }
        if rng.random_range(0..10) == 0 {
            bytes.truncate(rng.random_range(0..bytes.len()));
        }
        std::fs::write(&path, &bytes).unwrap();
        match try_read(&path) {
            Ok(_) => fine += 1,
            Err(message) => {
                assert!(!message.contains("panicked") && message.contains("fuzz.fits"), "{message}");
                refused += 1;
            }
        }
        // Classification must survive too.
        let _ = classify(&path, &config(&[]), &[]);
    }
    println!("{fine} read, {refused} refused");
    assert!(fine > 300 && refused > 300, "{fine} read, {refused} refused: the mutations test nothing");
}
