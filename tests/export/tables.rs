//! Tables in other formats: the same cells in all of them, read by programs that we did not write (cfitsio, csv, an XML
//! parser, and astropy where there is Python).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)] // tests

use crate::export_support;

use std::path::Path;

use export_support::{later, meta, missed, python_with, row, run_python};
use fitsio::FitsFile;
use quick_xml::Reader;
use quick_xml::events::Event;
use satphot::base::file::write_streamed;
use satphot::tables::formats::{Table, provenance, write_csv, write_fits, write_votable};
use satphot::tables::{
    Datatype, Meta, PHOTOMETRY, PhotometryRow, ResidualRow, StarRow, read_table, write_photometry, write_residuals,
    write_stars,
};

/// Names that break careless writers.
const NAMES: [&str; 9] =
    ["a,b", "say \"hi\"", "#1.fits", "météore ☾ 星 𝛼", "'", "back\\slash \\u0041", "<&>]]>", "it''s", "nan"];

fn rows() -> Vec<PhotometryRow> {
    let mut rows = vec![row(), later(12, 11.707), missed(24)];
    rows.extend(NAMES.iter().enumerate().map(|(k, name)| PhotometryRow {
        frame: (*name).into(),
        reason: format!("because of {name}"),
        flux_e: Some(-0.1 * k as f64),
        // every bit of a number counts
        mu_peak_mag_arcsec2: Some(std::f64::consts::PI * 10f64.powi(k as i32 * 30 - 120)),
        ..later(60 + k as i64, 12.0 + 1.0 / 3.0)
    }));
    rows.push(PhotometryRow { status: "failed".into(), verdict: "reject".into(), ..Default::default() });
    rows
}

/// Writes the rows as ECSV and reads them as cells.
fn table(folder: &Path, rows: &[PhotometryRow]) -> Table {
    let path = folder.join("photometry.ecsv");
    write_photometry(&path, rows, &meta()).unwrap();
    read_table(&path).unwrap()
}

fn fits(folder: &Path, table: &Table, stars: Option<&Table>) -> std::path::PathBuf {
    let path = folder.join("night.fits");
    let message =
        provenance(&table.meta, Some("[night]\nname = \"é\"\n"), Some("{\"inputs\":[{\"path\":\"a\"}]}")).unwrap();
    write_fits(&path, table, stars, &message).unwrap();
    path
}

fn in_memory(write: impl Fn(&mut Vec<u8>) -> std::io::Result<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut bytes).unwrap();
    bytes
}

/// What the escapes of the FITS texts stand for.
fn unescaped(text: &str) -> String {
    serde_json::from_str(&format!("\"{}\"", text.replace('"', "\\\""))).unwrap()
}

#[test]
fn a_table_read_as_cells_holds_the_texts_of_its_file() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    assert_eq!(
        (table.name, table.columns.len(), table.records.len()),
        ("photometry", PHOTOMETRY.columns.len(), rows().len())
    );
    assert_eq!(table.meta, meta());
    assert_eq!(table.rows::<PhotometryRow>().unwrap(), rows());
}

#[test]
fn each_kind_of_table_is_recognised_by_its_columns() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.ecsv");
    write_stars(&path, &[StarRow::default()], &Meta::default()).unwrap();
    assert_eq!(read_table(&path).unwrap().name, "stars");
    write_residuals(&path, &[ResidualRow::default()], &Meta::default()).unwrap();
    assert_eq!(read_table(&path).unwrap().name, "residuals");
    std::fs::write(&path, "# %ECSV 1.0\n# delimiter: ','\nra,dec\n1,2\n").unwrap();
    let message = read_table(&path).unwrap_err().to_string();
    assert!(message.contains("photometry") && message.contains("t.ecsv:3"), "{message}");
}

#[test]
fn cfitsio_reads_every_cell_of_the_fits_table_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let mut file = FitsFile::open(fits(dir.path(), &table, None)).unwrap();
    let hdu = file.hdu("PHOTOMETRY").unwrap();
    for (i, column) in table.columns.iter().enumerate() {
        let name = column.name.to_uppercase();
        let cells: Vec<&str> = table.records.iter().map(|r| r.get(i).unwrap()).collect();
        match column.datatype {
            Datatype::Float64 => {
                let back: Vec<f64> = hdu.read_col(&mut file, &name).unwrap();
                for (back, cell) in back.iter().zip(&cells) {
                    match cell.parse::<f64>() {
                        Ok(value) => assert_eq!(back.to_bits(), value.to_bits(), "{name}"),
                        Err(_) => assert!(back.is_nan(), "{name}"),
                    }
                }
            }
            Datatype::Int64 => {
                let back: Vec<i64> = hdu.read_col(&mut file, &name).unwrap();
                assert!(back.iter().zip(&cells).all(|(b, c)| *b == c.parse().unwrap_or(i64::MIN)), "{name}: {back:?}");
            }
            Datatype::Int32 => {
                let back: Vec<i32> = hdu.read_col(&mut file, &name).unwrap();
                assert!(back.iter().zip(&cells).all(|(b, c)| *b == c.parse::<i32>().unwrap()), "{name}: {back:?}");
            }
            Datatype::Text => {
                let back: Vec<String> = hdu.read_col(&mut file, &name).unwrap();
                let back: Vec<String> = back.iter().map(|t| unescaped(t.trim_end())).collect();
                assert_eq!(back, cells.iter().map(|c| c.trim_end()).collect::<Vec<_>>(), "{name}");
            }
        }
    }
}

#[test]
fn a_fits_file_holds_the_stars_and_the_provenance_with_the_photometry() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let path = dir.path().join("stars.ecsv");
    let star = StarRow { star_id: "APASS 7".into(), catalogue_v_mag: Some(12.5), ..Default::default() };
    write_stars(&path, &[star.clone(), star], &Meta::default()).unwrap();
    let stars = read_table(&path).unwrap();
    let mut file = FitsFile::open(fits(dir.path(), &table, Some(&stars))).unwrap();
    let zeropoint = file.hdu(2).unwrap();
    assert_eq!(zeropoint.read_key::<String>(&mut file, "EXTNAME").unwrap(), "ZEROPOINT");
    assert_eq!(zeropoint.read_col::<f64>(&mut file, "CATALOGUE_V_MAG").unwrap(), [12.5, 12.5]);
    let message = file.hdu("PROVENANCE").unwrap();
    let keys: Vec<String> = message.read_col(&mut file, "KEY").unwrap();
    let values: Vec<String> = message.read_col(&mut file, "VALUE").unwrap();
    let value = |key: &str| unescaped(&values[keys.iter().position(|k| k == key).unwrap()]);
    assert_eq!(value("meta.site.lat_deg"), "-33.77");
    assert_eq!(value("config.night.name"), "é");
    assert_eq!(value("manifest.inputs.0"), "{\"path\":\"a\"}");
    // without stars.ecsv the HDU is there, empty
    let mut file = FitsFile::open(fits(dir.path(), &table, None)).unwrap();
    let zeropoint = file.hdu("ZEROPOINT").unwrap();
    assert_eq!(zeropoint.read_key::<i64>(&mut file, "NAXIS2").unwrap(), 0);
}

/// The texts of all TD elements, row by row, and the FIELD names.
fn votable_cells(bytes: &[u8]) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = Reader::from_reader(bytes);
    let (mut buffer, mut names, mut rows, mut cell) = (Vec::new(), Vec::new(), Vec::new(), None::<String>);
    loop {
        match reader.read_event_into(&mut buffer).unwrap() {
            Event::Start(e) if e.name().as_ref() == "FIELD" => {
                let name = e.try_get_attribute("name").unwrap().unwrap();
                names.push(name.value.into_owned());
            }
            Event::Start(e) if e.name().as_ref() == "TR" => rows.push(Vec::new()),
            Event::Start(e) if e.name().as_ref() == "TD" => cell = Some(String::new()),
            Event::Text(e) => {
                if let Some(cell) = &mut cell {
                    cell.push_str(&e.xml10_content());
                }
            }
            Event::GeneralRef(e) => {
                let name = e.to_string();
                if let Some(cell) = &mut cell {
                    cell.push_str(&quick_xml::escape::unescape(&format!("&{name};")).unwrap());
                }
            }
            Event::End(e) if e.name().as_ref() == "TD" => rows.last_mut().unwrap().push(cell.take().unwrap()),
            Event::Eof => return (names, rows),
            _ => {}
        }
        buffer.clear();
    }
}

#[test]
fn a_votable_holds_every_cell_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let (names, cells) = votable_cells(&in_memory(|out| write_votable(out, &table)));
    assert_eq!(names, PHOTOMETRY.columns.iter().map(|c| c.name).collect::<Vec<_>>());
    let expected: Vec<Vec<&str>> = table.records.iter().map(|r| r.iter().collect()).collect();
    assert_eq!(cells, expected);
}

#[test]
fn a_csv_holds_every_cell_as_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let bytes = in_memory(|out| write_csv(out, &table));
    let mut reader = csv::Reader::from_reader(bytes.as_slice());
    let back: Vec<PhotometryRow> = reader.deserialize().map(|r| r.unwrap()).collect();
    assert_eq!(back, rows());
}

#[test]
fn a_text_that_a_spreadsheet_would_compute_gets_an_apostrophe_and_a_number_never() {
    let dir = tempfile::tempdir().unwrap();
    let formula = PhotometryRow { frame: "=cmd|'/c calc'!A1".into(), reason: "-x".into(), flux_e: Some(-1.5), ..row() };
    let table = table(dir.path(), &[formula]);
    let text = String::from_utf8(in_memory(|out| write_csv(out, &table))).unwrap();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let back: PhotometryRow = reader.deserialize().next().unwrap().unwrap();
    assert_eq!((back.frame.as_str(), back.reason.as_str()), ("'=cmd|'/c calc'!A1", "'-x"));
    assert_eq!(back.flux_e, Some(-1.5));
}

#[test]
fn a_table_without_rows_is_valid_in_every_format() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &[]);
    let mut file = FitsFile::open(fits(dir.path(), &table, None)).unwrap();
    let hdu = file.hdu("PHOTOMETRY").unwrap();
    assert_eq!(hdu.read_key::<i64>(&mut file, "NAXIS2").unwrap(), 0);
    let (names, cells) = votable_cells(&in_memory(|out| write_votable(out, &table)));
    assert_eq!((names.len(), cells.len()), (PHOTOMETRY.columns.len(), 0));
    let text = String::from_utf8(in_memory(|out| write_csv(out, &table))).unwrap();
    assert_eq!(text.lines().count(), 1);
}

#[test]
fn the_same_table_gives_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let once = std::fs::read(fits(dir.path(), &table, None)).unwrap();
    assert_eq!(once, std::fs::read(fits(dir.path(), &table, None)).unwrap());
    assert_eq!(once.len() % 2880, 0);
    // the words of every HDU add up to minus zero, and so do those of the file (FITS Standard 4.0, appendix J)
    let words = once.chunks(4).map(|word| u64::from(u32::from_be_bytes(word.try_into().unwrap())));
    let sum = words.fold(0, |sum: u64, word| (sum + word) % u64::from(u32::MAX));
    assert_eq!((sum, once.windows(9).filter(|w| w == b"CHECKSUM=").count()), (0, 4));
    assert_eq!(in_memory(|o| write_votable(o, &table)), in_memory(|o| write_votable(o, &table)));
}

#[test]
fn no_table_says_nan_where_a_number_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &[missed(0), PhotometryRow { status: "failed".into(), ..Default::default() }]);
    for bytes in [in_memory(|o| write_votable(o, &table)), in_memory(|o| write_csv(o, &table))] {
        let text = String::from_utf8(bytes).unwrap().to_lowercase();
        assert!(!text.contains("nan") && !text.contains(">inf<") && !text.contains(",inf,"), "{text}");
    }
}

/// astropy: the same values, masks and units in all formats; Time, checksums, UCDs.
const ASTROPY: &str = r#"
import json, warnings
import numpy as np
from astropy import units as u
from astropy.io import fits
from astropy.io.votable import parse_single_table
from astropy.io.votable.ucd import parse_ucd
from astropy.table import QTable, Table
from astropy.time import Time

ecsv = Table.read("photometry.ecsv")
with warnings.catch_warnings():
    warnings.simplefilter("error")
    with fits.open("night.fits", checksum=True) as f:
        f.verify("exception")
        assert [h.name for h in f] == ["PRIMARY", "PHOTOMETRY", "ZEROPOINT", "PROVENANCE"]
        head = f[1].header
        ucds = {head[f"TTYPE{i}"].lower(): head.get(f"TUCD{i}", "") for i in range(1, head["TFIELDS"] + 1)}
        comments = {head[f"TTYPE{i}"].lower(): head.get(f"TCOMM{i}", "") for i in range(1, head["TFIELDS"] + 1)}
        assert head["TIMESYS"] == "UTC" and head["MJDREF"] == 0.0 and head["TREFPOS"] == "TOPOCENT"
    vot = Table.read("night.vot", format="votable")
    fields = {f.name: f for f in parse_single_table("night.vot").fields}
    fit = Table.read("night.fits", hdu=1)
    q = QTable.read("night.fits", hdu=1)
    native = QTable.read("night.fits", hdu=1, astropy_native=True)

# time: the column of MJD is a Time without being asked for, good to a microsecond; the place is in the header
for t in (fit["MJD_MID_D"], q["MJD_MID_D"], native["MJD_MID_D"]):
    assert isinstance(t, Time) and t.scale == "utc" and t.format == "mjd"
    assert abs((t[0] - Time("2025-06-09T10:33:02.5", scale="utc")).sec) < 2e-6
assert [head[f"OBSGEO-{k}"] for k in "BLH"] == [-33.77, 151.111, 70.0]

unescape = lambda s: json.loads('"' + s.replace('"', '\\"') + '"')
for name in ecsv.colnames:
    a, v, f = ecsv[name], vot[name], fit[name.upper()]
    text = a.dtype.kind in "UO"
    if name == "mjd_mid_d":
        f = f.mjd if isinstance(f, Time) else f
        a = np.ma.asarray(a)
        good = ~np.ma.getmaskarray(a)
        assert np.array_equal(a.data[good], np.ma.asarray(v).data[good])
        assert np.all(np.abs(a.data[good] - np.ma.asarray(f).data[good]) < 1e-11)
        continue
    if text:
        plain = lambda col: ["" if x is np.ma.masked else str(x) for x in col]
        assert plain(a) == plain(v), (name, plain(a), plain(v))
        assert [x.rstrip() for x in plain(a)] == [unescape(x.rstrip()) for x in plain(f)], name
    else:
        masks = [np.ma.getmaskarray(np.ma.asarray(c)) for c in (a, v, f)]
        assert np.array_equal(masks[0], masks[1]) and np.array_equal(masks[0], masks[2]), (name, masks)
        good = ~masks[0]
        assert np.array_equal(np.asarray(a)[good], np.asarray(v)[good]), name
        assert np.array_equal(np.asarray(a)[good], np.asarray(f)[good]), name
        if a.unit is not None:
            words = lambda x: str(x).replace(" ", "").replace("%", "percent")
            assert words(v.unit) == words(a.unit), (name, a.unit, v.unit)
            assert f.unit is not None, name
            # FITS has counts for electrons, and percent as a factor
            in_fits = u.Unit(str(a.unit).replace("electron", "ct"))
            assert u.Unit(f.unit) == in_fits, (name, a.unit, f.unit)
            assert ("(ct: electrons)" in comments[name]) == ("electron" in str(a.unit)), name
    assert comments[name].replace(" (ct: electrons)", "") == a.description == fields[name].description, name
    assert ucds[name] == (fields[name].ucd or ""), name
    if ucds[name]:
        parse_ucd(ucds[name], check_controlled_vocabulary=True, has_colon=False)
assert q["V_MAG"].unit == u.mag and q["RANGE_KM"].unit == u.km
assert vot["v_mag"].mask[2] and not vot["v_mag"].mask[0]
assert fields["mjd_mid_d"].ref == "mjd_utc"
print("as expected")
"#;

#[test]
fn astropy_reads_the_same_values_masks_units_and_times_from_ecsv_fits_and_votable() {
    let Some(python) = python_with("astropy") else { return };
    let dir = tempfile::tempdir().unwrap();
    let rows: Vec<PhotometryRow> = rows().into_iter().filter(|r| r.mjd_mid_d.is_some()).collect();
    let table = table(dir.path(), &rows);
    fits(dir.path(), &table, None);
    write_streamed(&dir.path().join("night.vot"), |file| write_votable(file, &table)).unwrap();
    run_python(&python, dir.path(), ASTROPY);
}

#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_holds_every_row_with_its_units() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    let dir = tempfile::tempdir().unwrap();
    let table = table(dir.path(), &rows());
    let path = dir.path().join("night.parquet");
    write_streamed(&path, |file| satphot::tables::formats::write_parquet(file, &table)).unwrap();
    let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
    let at = |name: &str| PHOTOMETRY.columns.iter().position(|c| c.name == name).unwrap();
    let mut n = 0;
    for (row, expected) in reader.get_row_iter(None).unwrap().zip(rows()) {
        let row = row.unwrap();
        assert_eq!(row.get_double(at("v_mag")).ok(), expected.v_mag);
        assert_eq!(row.get_long(at("norad_cat_id")).ok(), expected.norad_cat_id);
        assert_eq!(row.get_string(at("frame")).map(String::as_str).unwrap_or(""), expected.frame);
        n += 1;
    }
    assert_eq!(n, rows().len());
    let Some(python) = python_with("pyarrow") else { return };
    let message: Vec<_> =
        PHOTOMETRY.columns.iter().map(|c| serde_json::json!([c.name, c.unit, c.ucd, c.description])).collect();
    std::fs::write(dir.path().join("schema.json"), serde_json::to_string(&message).unwrap()).unwrap();
    let v_mag: Vec<Option<f64>> = rows().iter().map(|r| r.v_mag).collect();
    std::fs::write(dir.path().join("v_mag.json"), serde_json::to_string(&v_mag).unwrap()).unwrap();
    run_python(&python, dir.path(), PYARROW);
}

/// pyarrow: unit, UCD and description of every field, the meta block, and what is missing is null.
#[cfg(feature = "parquet")]
const PYARROW: &str = r#"
import json
import pyarrow.parquet as p
table = p.read_table("night.parquet")
schema = json.load(open("schema.json"))
assert table.column_names == [name for name, *_ in schema]
for name, *stated in schema:
    meta = table.schema.field(name).metadata
    for key, value in zip(["unit", "ucd", "description"], stated):
        assert meta.get(key.encode(), b"").decode() == value, (name, key, meta)
meta = p.read_metadata("night.parquet").metadata
assert meta[b"site.lat_deg"] == b"-33.77" and meta[b"band"] == b"V", meta
v = table.column("v_mag")
assert v.to_pylist() == json.load(open("v_mag.json"))
assert v.null_count == sum(x is None for x in v.to_pylist()) > 0
assert not any(x is not None and x != x for c in table.columns for x in c.to_pylist()), "a NaN stands for nothing"
assert str(table.schema.field("norad_cat_id").type) == "int64" and str(table.schema.field("flags").type) == "int32"
print("as expected")
"#;

/// A file of pyarrow: moments with a zone, categories, single precision, what is missing, a column of lists, the units that
/// astropy states; satphot reads it as it would the same table in lines.
#[cfg(feature = "parquet")]
#[test]
fn a_parquet_file_of_pyarrow_is_read() {
    use satphot::tables::read::{Row, Table};

    let Some(python) = python_with("pyarrow") else { return };
    let dir = tempfile::tempdir().unwrap();
    run_python(&python, dir.path(), WRITTEN_BY_PYARROW);
    let path = dir.path().join("own.parquet");
    let mut table = Table::open(&path).unwrap();
    assert_eq!(table.names(), "moment, satellite, v, range, norad_cat_id");
    assert_eq!(table.notes.len(), 1, "{:?}", table.notes);
    assert!(table.notes[0].contains("column parts"), "{:?}", table.notes);
    assert_eq!((&*table.columns[0].time_scale, &*table.columns[3].unit), ("utc", "m"));
    let (mut row, mut n) = (Row::default(), 0);
    while table.read(&mut row).unwrap() {
        let lacking = n % 1000 == 1;
        assert_eq!(row.get(1), if n % 2 == 0 { "ISS" } else { "HST" });
        assert_eq!(row.get(2), if lacking { "" } else { "6.1" });
        assert_eq!(row.number(3), Some(1e6 + f64::from(n)));
        assert_eq!(row.get(4), "25544");
        let second = f64::from(n) * 1e-3;
        let want = format!("2025-06-09T10:{:02}:{:06.3}", 33 + n / 60_000, second % 60.0);
        assert_eq!(row.get(0).parse::<hifitime::Epoch>().unwrap(), want.parse().unwrap(), "{}", row.get(0));
        n += 1;
    }
    assert_eq!(n, 10_000);

    // cut anywhere it is refused by name
    let bytes = std::fs::read(&path).unwrap();
    for k in [5, 100, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&path, &bytes[..k]).unwrap();
        let error = Table::open(&path).unwrap_err().to_string();
        assert!(error.contains("own.parquet") && error.contains("damaged Parquet"), "{error}");
    }
}

#[cfg(feature = "parquet")]
const WRITTEN_BY_PYARROW: &str = r#"
import datetime
import pyarrow as pa
import pyarrow.parquet as p
n = 10_000
zone = datetime.timezone(datetime.timedelta(hours=10))
start = datetime.datetime(2025, 6, 9, 20, 33, 0, tzinfo=zone)
moment = pa.array([start + datetime.timedelta(milliseconds=k) for k in range(n)], pa.timestamp("ns", tz="Australia/Sydney"))
table = pa.table({
    "moment": moment,
    "satellite": pa.array(["ISS", "HST"] * (n // 2)).dictionary_encode(),
    "v": pa.array([None if k % 1000 == 1 else 6.1 for k in range(n)], pa.float32()),
    "parts": pa.array([[1.0, 2.0]] * n),
    "range": pa.array([1e6 + k for k in range(n)]),
    "norad_cat_id": pa.array([25544] * n, pa.uint32()),
})
yaml = "datatype:\n- {name: range, unit: m, datatype: float64}\n"
p.write_table(table.replace_schema_metadata({"table_meta_yaml": yaml}), "own.parquet", row_group_size=3000)
print("as expected")
"#;
