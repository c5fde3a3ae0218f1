//! Rows for exports, the facts they share, and Python with astropy where there is one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, dead_code)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use satphot::config::Reporter;
use satphot::export::{DataMode, Facts, Zeropoint};
use satphot::tables::{Meta, MetaValue, PhotometryRow};

/// The first exposure of the shared examples.
pub fn row() -> PhotometryRow {
    PhotometryRow {
        frame: "iss_0001.fits".into(),
        frame_sha256: "0011223344556677".into(),
        norad_cat_id: Some(25544),
        object_id: "1998-067A".into(),
        object_name: "ISS (Zarya)".into(),
        date_mid: "2025-06-09T10:33:02.500000Z".into(),
        mjd_mid_d: Some(60_835.439_612_268_52),
        exptime_s: Some(5.0),
        time_err_s: Some(0.5),
        e_per_adu: Some(0.0844),
        gain_setting: Some(200),
        x_px: Some(133.7),
        y_px: Some(105.25),
        flux_e: Some(5_000.0),
        flux_err_e: Some(100.0),
        sky_e_px: Some(20.0),
        pix_scale_arcsec: Some(1.566),
        snr: Some(50.0),
        inst_mag: Some(-11.25),
        v_mag: Some(11.934),
        v_mag_err: Some(0.021),
        v_mag_err_sys: Some(0.17),
        limit_v_mag: Some(14.2),
        alt_deg: Some(45.5),
        az_deg: Some(120.25),
        range_km: Some(587.5),
        phase_angle_deg: Some(67.0),
        illum: "moon".into(),
        status: "ok".into(),
        verdict: "use".into(),
        ..Default::default()
    }
}

/// A row `seconds` after the first of a night.
pub fn later(seconds: i64, v_mag: f64) -> PhotometryRow {
    let total = 10 * 3600 + 33 * 60 + 2 + seconds;
    PhotometryRow {
        frame: format!("iss_{seconds:05}.fits"),
        date_mid: format!("2025-06-09T{:02}:{:02}:{:02}.500000Z", total / 3600, total / 60 % 60, total % 60),
        mjd_mid_d: Some(60_835.0 + (total as f64 + 0.5) / 86_400.0),
        v_mag: Some(v_mag),
        ..row()
    }
}

/// A frame that shows nothing.
pub fn missed(seconds: i64) -> PhotometryRow {
    PhotometryRow {
        status: "nondetection".into(),
        v_mag: None,
        v_mag_err: None,
        inst_mag: None,
        limit_v_mag: Some(14.0),
        reason: "nothing above 5 sigma".into(),
        ..later(seconds, 0.0)
    }
}

/// The meta block of a real night.
pub fn meta() -> Meta {
    let number = |key: &str, value: f64| (key.to_owned(), MetaValue::Number(value));
    let mut meta = Meta::default();
    meta.push("schema", "satphot.photometry/1");
    meta.push("tool", "satphot 0.1.0");
    meta.push("telescope", "PlaneWave CDK24");
    meta.push("mag_system", "Vega");
    meta.push("band", "V");
    meta.push("data_mode", "REAL");
    let site = vec![number("lat_deg", -33.77), number("lon_deg", 151.111), number("alt_m", 70.0)];
    meta.push("site", MetaValue::Map(site));
    meta
}

/// What the rows share.
pub fn facts() -> Facts {
    let reporter = Reporter {
        organisation: Some("EXAMPLE_OBSERVATORY".into()),
        station: Some("MQ_CDK24".into()),
        email: Some("obs@example.org".into()),
        orcid: vec!["0000-0002-1825-0097".into(), "0000-0001-5109-3700".into()],
        instrument: Some("ZWO ASI6200MM Pro on PlaneWave CDK24".into()),
        observing_mode: Some("CMOS".into()),
        iod_station: Some("8000".into()),
        ..Default::default()
    };
    let mut facts = Facts::new(&meta(), None, reporter).unwrap();
    facts.zeropoint = Some(Zeropoint {
        zp_mag: -23.377,
        k_mag_airmass: 0.126,
        zp_err_mag: Some(0.013),
        k_err_mag_airmass: Some(0.01),
        n_used: Some(62.0),
    });
    assert_eq!(facts.data_mode, Some(DataMode::Real));
    facts
}

/// A file of the shared examples, if they are there.
pub fn shared(name: &str) -> Option<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/reference/formats").join(name);
    let text = std::fs::read_to_string(&path).ok();
    if text.is_none() {
        eprintln!("skipped: ../shared/reference/formats/{name} not present");
    }
    text
}

/// A Python that can `import module`: SATPHOT_PYTHON or `python3` if they can, else an environment of our own below the
/// target folder, into which the module is installed once. A message and `None` without Python, or where nothing can be installed
/// (offline; SATPHOT_NO_INSTALL is set).
pub fn python_with(module: &str) -> Option<PathBuf> {
    python_with_package(module, module)
}

/// As [`python_with`] for a module whose package has another name.
pub fn python_with_package(module: &str, package: &str) -> Option<PathBuf> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _held = ONE_AT_A_TIME.lock();
    let can = |python: &Path| {
        let tried = Command::new(python).args(["-c", &format!("import {module}")]).output();
        tried.is_ok_and(|o| o.status.success())
    };
    let given = std::env::var_os("SATPHOT_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("python");
    let own = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if let Some(python) = [&given, &own].into_iter().find(|p| can(p)) {
        return Some(python.clone());
    }
    let run = |python: &Path, words: &[&str]| -> Result<(), String> {
        let output = Command::new(python).args(words).output().map_err(|e| e.to_string())?;
        let said = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_string();
        if output.status.success() { Ok(()) } else { Err(said) }
    };
    let install = || {
        if std::env::var_os("SATPHOT_NO_INSTALL").is_some() {
            return Err("SATPHOT_NO_INSTALL is set".to_string());
        }
        if !own.exists() {
            run(&given, &["-m", "venv", &folder.to_string_lossy()])?;
        }
        let quick = ["--quiet", "--disable-pip-version-check", "--retries", "1", "--timeout", "15"];
        run(&own, &[&["-m", "pip", "install"], &quick[..], &[package]].concat())
    };
    match install() {
        Ok(()) if can(&own) => Some(own),
        Ok(()) => panic!("{module} was installed into {} and cannot be imported", folder.display()),
        Err(why) => {
            eprintln!("skipped: no Python with {module}, and it cannot be installed ({why}); SATPHOT_PYTHON names one");
            None
        }
    }
}

/// Runs a Python script; it must print `as expected` at its end.
pub fn run_python(python: &Path, folder: &Path, script: &str) {
    let output = Command::new(python).args(["-c", script]).current_dir(folder).output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && out.trim_end().ends_with("as expected"), "{out}\n{err}");
}
