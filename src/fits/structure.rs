//! What a header promises, held against what can be: mandatory cards and their order, sizes, column formats, tiles.
//!
//! Bytes and pixels. Nothing is read or allocated here. It does not cover the reading of headers ([`super::scan`]) and
//! values of keywords that are not structure.

use super::cards::{Card, Header, ImageInfo, join_continued};

/// Bytes of a card (FITS 4.0 section 3.1).
const CARD: usize = 80;
/// Most pixels of an image.
const MAX_PIXELS: usize = 1 << 30;
/// Pixels per byte of file that compression can reach; more is a lie.
const MAX_RATIO: u128 = 4_000;

/// What kind of HDU a header describes.
pub(crate) enum Kind {
    Image(Vec<usize>),
    Other(String),
}

/// One header as far as the sizes are concerned.
pub(crate) struct Hdu {
    pub(crate) cards: Vec<Card>,
    /// Data bytes, without padding.
    pub(crate) data_bytes: u128,
    /// What is odd about the header but no reason to refuse it.
    pub(crate) warnings: Vec<String>,
}

/// Checks the mandatory cards and their order; computes the size of the data.
pub(crate) fn check_hdu(raw: Vec<u8>, index: usize) -> std::result::Result<Hdu, String> {
    let foreign = raw.chunks(CARD).filter(|card| card.iter().any(|b| *b > 0x7e)).count();
    let mut warnings = Vec::new();
    if foreign > 0 {
        warnings.push(format!("{foreign} cards of HDU {index} hold characters that are not ASCII; they are read as ?"));
    }
    let cards: Vec<Card> = raw
        .chunks(CARD)
        .take_while(|c| !(c.starts_with(b"END") && c[3..].iter().all(|b| *b == b' ')))
        .filter_map(Card::parse)
        .collect();
    let cards = join_continued(cards);
    let header = Header::new(cards.clone(), ImageInfo::default());
    let first = if index == 0 { "SIMPLE" } else { "XTENSION" };
    expect_order(&cards, 0, first)?;
    expect_order(&cards, 1, "BITPIX")?;
    expect_order(&cards, 2, "NAXIS")?;
    if index == 0 && header.logical("SIMPLE") != Some(true) {
        return Err("SIMPLE is not T: the file says itself that it is not standard FITS".into());
    }
    let bitpix = whole(&header, "BITPIX")?;
    if ![8, 16, 32, 64, -32, -64].contains(&bitpix) {
        return Err(format!("BITPIX = {bitpix} is not one of 8, 16, 32, 64, -32, -64"));
    }
    let naxis = whole(&header, "NAXIS")?;
    if !(0..=99).contains(&naxis) {
        return Err(format!("NAXIS = {naxis} is outside 0 to 99"));
    }
    if header.logical("GROUPS") == Some(true) {
        return Err("random groups (GROUPS = T) are not images".into());
    }
    let mut pixels: u128 = u128::from(naxis > 0);
    for n in 1..=naxis {
        let key = format!("NAXIS{n}");
        expect_order(&cards, 2 + n as usize, &key)?;
        let length = whole(&header, &key)?;
        let length = u128::try_from(length).map_err(|_| format!("{key} = {length} is negative"))?;
        pixels = pixels.checked_mul(length).ok_or_else(|| format!("{key} = {length}: the product overflows"))?;
    }
    let (pcount, gcount) =
        if index == 0 { (0, 1) } else { (optional(&header, "PCOUNT", 0)?, optional(&header, "GCOUNT", 1)?) };
    let data_bytes = (pixels.checked_add(pcount).and_then(|p| p.checked_mul(gcount)))
        .and_then(|p| p.checked_mul(u128::from(bitpix.unsigned_abs()) / 8))
        .filter(|b| *b < 1 << 62)
        .ok_or("NAXISn, PCOUNT or GCOUNT are absurdly large")?;
    Ok(Hdu { cards, data_bytes, warnings })
}

fn expect_order(cards: &[Card], at: usize, key: &str) -> std::result::Result<(), String> {
    match cards.get(at) {
        Some(c) if c.keyword == key => Ok(()),
        Some(c) => Err(format!("card {at} is {} where the standard requires {key}", c.keyword)),
        None => Err(format!("{key} is missing")),
    }
}

/// A mandatory whole number, written as one.
fn whole(header: &Header, key: &str) -> std::result::Result<i64, String> {
    let card = header.card(key).ok_or_else(|| format!("{key} is missing"))?;
    let value = card.value.parse().ok().filter(|_| !card.is_text);
    value.ok_or_else(|| format!("{key} = {:?} is not a whole number", card.value))
}

fn optional(header: &Header, key: &str, absent: u128) -> std::result::Result<u128, String> {
    if header.card(key).is_none() {
        return Ok(absent);
    }
    let value = whole(header, key)?;
    u128::try_from(value).map_err(|_| format!("{key} = {value} is negative"))
}

/// Distinguishes images from the rest and checks what decoding relies on.
pub(crate) fn kind(header: &Header, index: usize, file_bytes: u128) -> std::result::Result<Kind, String> {
    let xtension = header.text("XTENSION").unwrap_or_default();
    if index > 0 && (xtension == "BINTABLE" || xtension == "A3DTABLE" || xtension == "TABLE") {
        check_table(header, xtension == "TABLE")?;
        if header.logical("ZIMAGE") == Some(true) && xtension == "BINTABLE" {
            return compressed(header, file_bytes);
        }
        return Ok(Kind::Other("is a table".into()));
    }
    let axes = axes(header, "NAXIS")?;
    if index > 0 && xtension != "IMAGE" {
        return Ok(Kind::Other(format!("has XTENSION = '{xtension}'")));
    }
    image_or_other(axes)
}

fn axes(header: &Header, name: &str) -> std::result::Result<Vec<usize>, String> {
    let n = whole(header, name)?;
    (1..=n)
        .map(|i| {
            let key = format!("{name}{i}");
            let v = whole(header, &key)?;
            usize::try_from(v).map_err(|_| format!("{key} = {v} is negative"))
        })
        .collect()
}

/// An image, if it is one: larger than any detector it is a lie, and a sparse file can hold one.
fn image_or_other(axes: Vec<usize>) -> std::result::Result<Kind, String> {
    let is_image = axes.len() >= 2 && axes[0] > 0 && axes[1] > 0 && axes[2..].iter().all(|n| *n == 1);
    if is_image && axes[0].checked_mul(axes[1]).is_none_or(|pixels| pixels > MAX_PIXELS) {
        return Err(format!("{} x {} pixels; images of at most {MAX_PIXELS} are read", axes[0], axes[1]));
    }
    Ok(match axes.as_slice() {
        _ if is_image => Kind::Image(axes),
        [] => Kind::Other("holds no data".into()),
        [_, _, more @ ..] if more.iter().any(|n| *n > 1) => {
            Kind::Other(match more.iter().fold(1_usize, |all, n| all.saturating_mul(*n)) {
                3 => format!("has axes {axes:?}: a colour image of 3 planes; one colour plane per file is read"),
                n => format!("has axes {axes:?}: a cube of {n} planes; one exposure per file is read"),
            })
        }
        _ => Kind::Other(format!("has axes {axes:?}")),
    })
}

/// Column formats of the plain form, and rows as wide as their columns.
fn check_table(header: &Header, ascii: bool) -> std::result::Result<(), String> {
    if whole(header, "BITPIX")? != 8 || whole(header, "NAXIS")? != 2 {
        return Err("a table needs BITPIX = 8 and NAXIS = 2".into());
    }
    let fields = whole(header, "TFIELDS")?;
    if !(0..=999).contains(&fields) {
        return Err(format!("TFIELDS = {fields} is outside 0 to 999"));
    }
    let mut width: u128 = 0;
    for n in 1..=fields {
        let key = format!("TFORM{n}");
        let form = header.card(&key).filter(|c| c.is_text).map(|c| c.value.as_str());
        let form = form.ok_or_else(|| format!("{key} is missing"))?;
        if ascii {
            let plain = form.starts_with(['A', 'I', 'F', 'E', 'D'])
                && form[1..].split('.').all(|d| !d.is_empty() && d.len() < 4 && d.bytes().all(|b| b.is_ascii_digit()))
                && form[1..].split('.').next().is_some_and(|w| w.parse::<u32>().is_ok_and(|w| w > 0));
            if !plain {
                return Err(format!("{key} = '{form}' is not a plain column format"));
            }
        } else {
            width += column_bytes(form).ok_or_else(|| format!("{key} = '{form}' is not a plain column format"))?;
        }
    }
    let row = whole(header, "NAXIS1")?;
    if !ascii && u128::try_from(row).ok() != Some(width) {
        return Err(format!("NAXIS1 = {row}, but the columns take {width} bytes"));
    }
    Ok(())
}

/// Bytes per row of a TFORM of the plain form `rT` or `rPT(n)` (FITS 4.0 table 18).
pub(crate) fn column_bytes(form: &str) -> Option<u128> {
    let digits = form.bytes().take_while(u8::is_ascii_digit).count();
    let repeat: u128 = if digits == 0 { 1 } else { form[..digits].parse().ok()? };
    let mut rest = form[digits..].chars();
    let code = rest.next()?;
    let rest = rest.as_str();
    let bytes = match code {
        'L' | 'B' | 'A' => repeat,
        'X' => repeat.div_ceil(8),
        'I' => repeat.checked_mul(2)?,
        'J' | 'E' => repeat.checked_mul(4)?,
        'K' | 'D' | 'C' => repeat.checked_mul(8)?,
        'M' => repeat.checked_mul(16)?,
        'P' | 'Q' => {
            let length = rest.get(1..)?;
            let plain = rest.starts_with(['L', 'X', 'B', 'I', 'J', 'K', 'A', 'E', 'D', 'C', 'M'])
                && (length.is_empty()
                    || length
                        .strip_prefix('(')
                        .and_then(|l| l.strip_suffix(')'))
                        .is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit())));
            return (plain && repeat <= 1).then_some(repeat * if code == 'P' { 8 } else { 16 });
        }
        _ => return None,
    };
    // `rAw` gives the width of sub-strings; nothing else may follow the code.
    let width_ok =
        rest.is_empty() || (code == 'A' && rest.parse::<u32>().is_ok_and(|w| w > 0 && u128::from(w) <= repeat));
    (width_ok && repeat < 1 << 40).then_some(bytes)
}

/// A tile-compressed image: tile sizes, number of rows, and a size that the file can hold.
fn compressed(header: &Header, file_bytes: u128) -> std::result::Result<Kind, String> {
    const KINDS: [&str; 7] = ["RICE_1", "RICE_ONE", "GZIP_1", "GZIP_2", "PLIO_1", "HCOMPRESS_1", "NOCOMPRESS"];
    let how = header.text("ZCMPTYPE").unwrap_or_default();
    if !KINDS.contains(&how.as_str()) {
        return Err(format!("ZCMPTYPE = '{how}' is not one of {}", KINDS.join(", ")));
    }
    let bitpix = whole(header, "ZBITPIX")?;
    if ![8, 16, 32, 64, -32, -64].contains(&bitpix) {
        return Err(format!("ZBITPIX = {bitpix} is not one of 8, 16, 32, 64, -32, -64"));
    }
    let n = whole(header, "ZNAXIS")?;
    if !(1..=6).contains(&n) {
        return Err(format!("ZNAXIS = {n} is outside 1 to 6"));
    }
    let axes = axes(header, "ZNAXIS")?;
    let (mut pixels, mut tiles) = (1u128, 1u128);
    for (i, length) in axes.iter().enumerate() {
        let key = format!("ZTILE{}", i + 1);
        let default = if i == 0 { *length as i64 } else { 1 };
        let tile = if header.card(&key).is_some() { whole(header, &key)? } else { default };
        if tile < 1 || *length < 1 || tile > i64::from(i32::MAX) || *length > i32::MAX as usize {
            return Err(format!("{key} = {tile} with ZNAXIS{} = {length}: both must be at least 1", i + 1));
        }
        pixels = pixels.saturating_mul(*length as u128);
        tiles = tiles.saturating_mul((*length as u128).div_ceil(tile as u128));
    }
    if pixels > file_bytes.saturating_mul(MAX_RATIO) {
        return Err(format!("ZNAXISn promise {pixels} pixels, more than {file_bytes} bytes can hold"));
    }
    let rows = whole(header, "NAXIS2")?;
    if u128::try_from(rows).ok() != Some(tiles) {
        return Err(format!("{rows} rows in the table, but ZNAXISn and ZTILEn make {tiles} tiles"));
    }
    for i in 1..=99 {
        let Some(name) = header.text(&format!("ZNAME{i}")) else { break };
        let value = header.integer(&format!("ZVAL{i}"));
        let fine = match name.as_str() {
            "BLOCKSIZE" => value.is_some_and(|v| (1..=1_024).contains(&v)),
            "BYTEPIX" => value.is_some_and(|v| [1, 2, 4, 8].contains(&v)),
            _ => true,
        };
        if !fine {
            return Err(format!("ZVAL{i} = {value:?} is not a usable {name}"));
        }
    }
    image_or_other(axes)
}
