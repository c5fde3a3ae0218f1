//! The sensor against laws and an end-to-end reduction: photons kept, electrons of the right number, files that reduce.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use hifitime::Epoch;
use ndarray::Array2;
use satphot::base::progress::Silent;
use satphot::brightness::spectrum::{SolarColumn, Spectrum};
use satphot::config::Config;
use satphot::figures::radiance::snr::snr_rows;
use satphot::pipeline::options::Options;
use satphot::pipeline::run::run;
use satphot::resolved::sensor::{
    Blur, FrameFacts, Pupil, Sampling, Seeing, Sensor, SensorSettings, SkyConditions, signal_to_noise, stamp,
    write_frame,
};
use satphot::resolved::{Light, RadianceImage};
use satphot::tables::read_photometry;

const ARCSEC: f64 = 4.848_136_811_095_36e-6;

/// An even disc of a radius [arcsec] in one light and a ramp in another, on pixels of 0.3 arcsec.
fn disc(radius_arcsec: f64, w_m2_sr: f64) -> RadianceImage {
    let n = 2 * (radius_arcsec / 0.3).ceil() as usize + 4;
    let inside = |j: usize, i: usize| {
        let (y, x) = (j as f64 - 0.5 * (n as f64 - 1.0), i as f64 - 0.5 * (n as f64 - 1.0));
        y.hypot(x) * 0.3 < radius_arcsec
    };
    let even = Array2::from_shape_fn((n, n), |(j, i)| if inside(j, i) { w_m2_sr } else { 0.0 });
    let ramp = Array2::from_shape_fn((n, n), |(j, i)| even[[j, i]] * i as f64 / n as f64);
    RadianceImage {
        pixel_rad: 0.3 * ARCSEC,
        range_km: 500.0,
        planes: vec![(Light::Sun, even), (Light::Moon, ramp)],
        wavelength_um: 0.6,
        band_um: (0.3, 1.05),
    }
}

fn blurs() -> Vec<Blur> {
    let cdk24 = Pupil { aperture_m: 0.61, obstruction: 0.47, wavelength_um: 0.6 };
    let still = Blur { seeing: Seeing::None, pupil: Some(cdk24), jitter_arcsec: 0.0, drift_arcsec: (0.0, 0.0) };
    vec![
        still,
        Blur { seeing: Seeing::Gaussian { fwhm_arcsec: 2.0 }, pupil: None, ..still },
        Blur { seeing: Seeing::Moffat { fwhm_arcsec: 1.5, beta: 2.5 }, jitter_arcsec: 0.4, ..still },
        Blur { seeing: Seeing::Moffat { fwhm_arcsec: 1.0, beta: 3.5 }, drift_arcsec: (-7.0, 3.0), ..still },
        Blur { pupil: None, ..still },
    ]
}

#[test]
fn every_photon_that_comes_in_lies_on_some_pixel() {
    let image = disc(12.0, 3e-6);
    for blur in blurs() {
        for (pixel_arcsec, centre) in [(0.1957, (300.0, 299.5)), (1.5659, (17.31, -4.87)), (9.0, (0.0, 0.0))] {
            let got = stamp(&image, &blur, pixel_arcsec, centre, &Sampling::default()).unwrap();
            for (light, plane) in &got.planes {
                let ratio = plane.sum() / image.irradiance_w_m2(*light);
                assert!((ratio - 1.0).abs() < 1e-9, "{blur:?} {pixel_arcsec} {}: {ratio}", light.name());
                // nothing is negative but rounding
                let brightest = plane.iter().copied().fold(0.0, f64::max);
                assert!(plane.iter().all(|v| *v > -1e-12 * brightest));
            }
            assert_eq!(got.planes.len(), 2);
        }
    }
}

#[test]
fn a_picture_stays_where_it_is_put() {
    let image = disc(5.0, 1.0);
    for blur in blurs() {
        for centre in [(100.0, 80.0), (100.37, 79.81)] {
            let got = stamp(&image, &blur, 0.3915, centre, &Sampling::default()).unwrap();
            let even = &got.planes[0].1;
            let (mut x, mut y) = (0.0, 0.0);
            for ((j, i), v) in even.indexed_iter() {
                x += v * (got.x0 as f64 + i as f64);
                y += v * (got.y0 as f64 + j as f64);
            }
            let at = (x / even.sum(), y / even.sum());
            assert!((at.0 - centre.0).abs() < 1e-3 && (at.1 - centre.1).abs() < 1e-3, "{blur:?} {at:?} {centre:?}");
        }
    }
}

#[test]
fn the_width_of_a_star_is_that_of_its_parts() {
    // second moments add: a Gaussian of the seeing, of the jitter, the box of a drift, the pixel of the picture, that of
    // the grid the picture is put on, and that of the detector
    let mut image = disc(0.3, 1.0);
    image.planes = vec![(Light::Sun, Array2::from_shape_fn((1, 1), |_| 1.0))];
    let sigma = 2.0 / 2.354_820_045;
    for (jitter_arcsec, drift) in [(0.0, 0.0), (0.7, 0.0), (0.3, 6.0)] {
        let blur = Blur {
            seeing: Seeing::Gaussian { fwhm_arcsec: 2.0 },
            pupil: None,
            jitter_arcsec,
            drift_arcsec: (drift, 0.0),
        };
        let got = stamp(&image, &blur, 0.25, (50.0, 50.0), &Sampling::default()).unwrap();
        let plane = &got.planes[0].1;
        let (mut xx, mut yy, sum) = (0.0, 0.0, plane.sum());
        for ((j, i), v) in plane.indexed_iter() {
            xx += v * (0.25 * (got.x0 as f64 + i as f64 - 50.0)).powi(2) / sum;
            yy += v * (0.25 * (got.y0 as f64 + j as f64 - 50.0)).powi(2) / sum;
        }
        let boxes = (0.3f64.powi(2) + 2.0 * 0.25f64.powi(2)) / 12.0;
        let expected = sigma * sigma + jitter_arcsec * jitter_arcsec + boxes;
        // sinc² of grids that share edges with nothing: the picture's own cell is known to its size
        assert!((yy / expected - 1.0).abs() < 0.015, "{yy} {expected}");
        assert!((xx / (expected + drift * drift / 12.0) - 1.0).abs() < 0.015, "{xx} {expected}");
    }
}

#[test]
fn electrons_are_photons_times_what_the_telescope_passes() {
    // a flat detector in a narrow band, where the Sun's spectrum is flat enough for one wavelength
    let sets = ["optics.qe=0.5", "optics.transmission=0.8"].map(String::from);
    let settings = SensorSettings::named("macquarie-cdk24", &sets).unwrap();
    let sensor = Sensor::new(&settings, (0.599, 0.601)).unwrap();
    let photons_per_j = 0.6e-6 / (6.626_070_15e-34 * 2.997_924_58e8);
    let expected = 0.227_689 * 0.8 * 0.5 * photons_per_j;
    assert!((sensor.e_s_per_w_m2 / expected - 1.0).abs() < 1e-3, "{} {expected}", sensor.e_s_per_w_m2);
    // over the whole band the Sun itself is V -26.76, and the camera's curve gives the calculator's zeropoint
    let whole = Sensor::new(&SensorSettings::named("macquarie-cdk24", &[]).unwrap(), (0.3, 1.05)).unwrap();
    assert!((whole.mag_of_w_m2(whole.sun_w_m2).unwrap() + 26.76).abs() < 1e-9);
    assert!((whole.zp_mag - 24.25).abs() < 0.02, "{}", whole.zp_mag);
    let sun = Spectrum::sun(SolarColumn::Extraterrestrial).unwrap().irradiance_w_m2(300.0, 1050.0);
    assert!((whole.sun_w_m2 - sun).abs() < 1e-9 && (900.0..1050.0).contains(&sun), "{sun}");
    assert_eq!(whole.mag_of_w_m2(0.0), None);
}

#[test]
fn bands_and_exposures_without_sense_are_refused() {
    let settings = SensorSettings::named("macquarie-cdk24", &[]).unwrap();
    for (band, said) in [((2.0, 3.0), "does not meet"), ((0.6, 0.6), "no sunlight"), ((f64::NAN, 1.0), "band NaN")] {
        let error = Sensor::new(&settings, band).unwrap_err().to_string();
        assert!(error.contains(said), "{band:?}: {error}");
    }
    let sensor = Sensor::new(&settings, (0.3, 1.05)).unwrap();
    let air = SkyConditions { sky_mag_arcsec2: 20.0, extinction_mag: 0.1 };
    let image = disc(2.0, 1e-6);
    assert!(sensor.expose(&image, 0.0, &air, (0.0, 0.0)).is_err());
    assert!(sensor.expose(&image, 1.0, &SkyConditions { extinction_mag: -1.0, ..air }, (0.0, 0.0)).is_err());
    assert!(sensor.expose(&image, 1.0, &SkyConditions { sky_mag_arcsec2: f64::NAN, ..air }, (0.0, 0.0)).is_err());
    let mut negative = image.clone();
    negative.planes[0].1[[0, 0]] = -1.0;
    assert!(sensor.expose(&negative, 1.0, &air, (0.0, 0.0)).unwrap_err().to_string().contains("-1"));
    let none = RadianceImage { planes: Vec::new(), ..image.clone() };
    assert!(sensor.expose(&none, 1.0, &air, (0.0, 0.0)).unwrap_err().to_string().contains("no light"));
    let huge = RadianceImage { pixel_rad: 1.0, ..image };
    assert!(sensor.expose(&huge, 1.0, &air, (0.0, 0.0)).unwrap_err().to_string().contains("too large"));
}

#[test]
fn noise_belongs_to_its_seed_and_has_the_variance_of_its_electrons() {
    let sets = ["frame.nx_px=256", "frame.ny_px=256"].map(String::from);
    let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &sets).unwrap(), (0.3, 1.05)).unwrap();
    let dark = disc(1.0, 0.0);
    let air = SkyConditions { sky_mag_arcsec2: 18.0, extinction_mag: 0.0 };
    let exposure = sensor.expose(&dark, 30.0, &air, (0.0, 0.0)).unwrap();
    let (a, b, c) = (sensor.read_out(&exposure, 1), sensor.read_out(&exposure, 1), sensor.read_out(&exposure, 2));
    assert!(a == b && a != c);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(one.install(|| sensor.read_out(&exposure, 1)) == a);
    let e: Vec<f64> = a.iter().map(|n| (f64::from(*n) - 500.0) * sensor.gain.e_per_adu.0).collect();
    let mean = e.iter().sum::<f64>() / e.len() as f64;
    let variance = e.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / e.len() as f64;
    let expected = exposure.sky_e_px + exposure.dark_e_px;
    let noise2 = expected + sensor.gain.read_noise_e.powi(2) + sensor.gain.e_per_adu.0.powi(2) / 12.0;
    // 65536 pixels: the mean to σ/256, the variance to a factor √(2/65536)
    assert!((mean - expected).abs() < 4.0 * (noise2 / 65_536.0).sqrt(), "{mean} {expected}");
    assert!((variance / noise2 - 1.0).abs() < 4.0 * (2.0f64 / 65_536.0).sqrt(), "{variance} {noise2}");
}

#[test]
fn a_picture_too_bright_fills_the_wells_and_says_so() {
    let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &[]).unwrap(), (0.3, 1.05)).unwrap();
    let air = SkyConditions { sky_mag_arcsec2: 20.0, extinction_mag: 0.0 };
    let exposure = sensor.expose(&disc(10.0, 1.0), 1.0, &air, (0.0, 0.0)).unwrap();
    let counts = sensor.read_out(&exposure, 3);
    let full = exposure.n_saturated(sensor.full_well_e());
    assert!(full > 5_000, "{full}");
    assert_eq!(*counts.iter().max().unwrap(), 65_535);
    assert!(sensor.n_saturated(&counts) >= full);
    let rows = snr_rows(&signal_to_noise(&exposure, 1.4, &[vec![Light::Sun]]), sensor.n_saturated(&counts));
    assert!(rows[0].saturated_px as usize >= full);
}

#[test]
fn the_header_states_saturation_light_outside_the_frame_and_the_system_of_its_zeropoint() {
    let sets = ["frame.nx_px=64", "frame.ny_px=64", "optics.filter=g"].map(String::from);
    let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &sets).unwrap(), (0.3, 1.05)).unwrap();
    let (image, air) = (disc(10.0, 1.0), SkyConditions { sky_mag_arcsec2: 20.0, extinction_mag: 0.0 });
    let exposure = sensor.expose(&image, 1.0, &air, (0.0, 0.0)).unwrap();
    let counts = sensor.read_out(&exposure, 3);
    let facts = FrameFacts {
        object: "ISS (ZARYA)".into(),
        norad_cat_id: None,
        site: sensor.settings().site.clone(),
        v_mag: Some(-3.0),
        mid: Epoch::from_gregorian_utc(2025, 6, 9, 10, 33, 2, 0),
        alt_deg: 32.1,
        az_deg: 210.0,
        seed: 3,
        history: Vec::new(),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.fits");
    write_frame(&path, &counts, &sensor, &exposure, &image, &facts).unwrap();
    let header = String::from_utf8_lossy(&std::fs::read(&path).unwrap()[..2880 * 3]).into_owned();
    let value = |key: &str| {
        let (_, rest) = header.split_once(&format!("{key:<8}=")).unwrap();
        rest.split('/').next().unwrap().trim().trim_end_matches('.').parse::<f64>().unwrap()
    };
    assert_eq!(value("SATURATE"), sensor.gain.saturation_adu);
    assert_eq!(value("SIMNSAT"), sensor.n_saturated(&counts) as f64);
    assert!(value("SIMNSAT") > 4_000.0 && value("SIMLOST") > 0.1 && value("SIMVMAG") == -3.0);
    assert!(header.contains("[mag] g, AB, of 1 e-/s") && header.contains("% of the light fell outside the frame"));
}

/// Differences of measured and true electrons, relative and in errors, of eight frames through a sensor with these settings.
fn reduced(more: &[&str]) -> Vec<(f64, f64)> {
    let folder = tempfile::tempdir().unwrap();
    let sets = ["frame.nx_px=300", "frame.ny_px=300", "frame.binning=4"];
    let sets: Vec<String> = sets.iter().chain(more).map(|s| (*s).to_string()).collect();
    let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &sets).unwrap(), (0.3, 1.05)).unwrap();
    let image = disc(20.0, 2e-5);
    let air = SkyConditions { sky_mag_arcsec2: 19.0, extinction_mag: 0.15 };
    let mid = Epoch::from_gregorian_utc(2025, 6, 9, 10, 33, 2, 500_000_000);
    let mut truth = Vec::new();
    for k in 0..8u32 {
        let off = (f64::from(k) * 1.37 - 4.0, 3.0 - f64::from(k) * 0.71);
        let exposure = sensor.expose(&image, 2.0 + f64::from(k), &air, off).unwrap();
        assert_eq!(exposure.n_saturated(sensor.full_well_e()), 0);
        assert!(exposure.outside_frac < 1e-12);
        let facts = FrameFacts {
            object: "ISS (ZARYA)".into(),
            norad_cat_id: Some(25_544),
            site: sensor.settings().site.clone(),
            v_mag: None,
            mid: mid + f64::from(k) * 20.0 * hifitime::Unit::Second,
            alt_deg: 32.1,
            az_deg: 210.0,
            seed: 100 + u64::from(k),
            history: vec!["an even disc".into()],
        };
        let counts = sensor.read_out(&exposure, facts.seed);
        let path = folder.path().join(format!("iss_{k}.fits"));
        write_frame(&path, &counts, &sensor, &exposure, &image, &facts).unwrap();
        truth.push(exposure.satellite_e());
    }
    let night = "preset = \"macquarie-cdk24\"\n[night]\nname = \"n\"\ninput = [\".\"]\noutput = \"out\"\n\
                 [frames]\ntarget = [\"iss_*\"]\n[photometry]\nclip_radius_px = 200.0\n";
    std::fs::write(folder.path().join("pipeline.toml"), night).unwrap();
    let config = Config::load(&folder.path().join("pipeline.toml"), &[]).unwrap();
    run(&config, &Options { jobs: 2, no_figures: true, ..Options::default() }, &Silent).unwrap();
    let rows = read_photometry(&folder.path().join("out/n/photometry.ecsv")).unwrap().0;
    assert_eq!(rows.len(), truth.len());
    let mut differences = Vec::new();
    for (row, truth) in rows.iter().zip(&truth) {
        assert_eq!(row.status, "ok", "{row:?}");
        if row.frame == "iss_0.fits" {
            assert!(row.date_mid.starts_with("2025-06-09T10:33:02.500"), "{}", row.date_mid);
        }
        let (flux, err) = (row.flux_e.unwrap(), row.flux_err_e.unwrap());
        println!("{} {flux:.0} {truth:.0} {err:.0} {:+.2}", row.frame, (flux - truth) / err);
        differences.push((flux / truth - 1.0, (flux - truth) / err));
    }
    differences
}

#[test]
fn a_frame_of_the_sensor_reduces_to_the_electrons_that_were_put_in() {
    // a PSF without wings: all the light is in the aperture around the whole object
    let differences = reduced(&["blur.seeing=gaussian", "blur.diffraction=false"]);
    let mean = differences.iter().map(|d| d.1).sum::<f64>() / differences.len() as f64;
    // eight pulls: their mean scatters by 0.35
    assert!(mean.abs() < 1.2, "{differences:?}");
    assert!(differences.iter().all(|d| d.1.abs() < 4.0), "{differences:?}");
}

#[test]
fn wings_beyond_the_aperture_are_lost_without_a_zeropoint_and_no_more_than_they_hold() {
    // Moffat and the ring of the aperture: 0.3 % beyond the aperture of a target of 40 arcsec
    let differences = reduced(&[]);
    let mean = differences.iter().map(|d| d.0).sum::<f64>() / differences.len() as f64;
    assert!((-0.01..0.002).contains(&mean), "{differences:?}");
}

#[test]
fn the_published_ratios_fit_no_single_definition_of_signal_over_noise() {
    // 0.575, 307 and 467 for irradiances 1, 294 and 456 times the starlight. Summed or matched, the ratio of two S/N is at
    // most that of the irradiances; only the brightest pixel, whose radiance grows 828 times, can reach 534, and then its
    // 1.14 times more light for the third picture cannot give 1.52.
    let (snr, irradiance) = ([0.575, 307.0, 467.0], [2.87e-20, 8.45e-18, 1.31e-17]);
    let (brightest, published) = ([1.63e-11, 1.35e-8, 1.54e-8], (snr[1] / snr[0], snr[2] / snr[1]));
    assert!(published.0 > irradiance[1] / irradiance[0] && published.0 < brightest[1] / brightest[0]);
    assert!(published.1 < irradiance[2] / irradiance[1] && published.1 > brightest[2] / brightest[1]);
    // the bound itself, on a picture through the sensor
    let sensor = Sensor::new(&SensorSettings::named("macquarie-cdk24", &[]).unwrap(), (0.3, 1.05)).unwrap();
    let mut image = disc(15.0, 1e-8);
    image.planes[1] = (Light::Starlight, &image.planes[0].1 / 294.0);
    image.planes[0].0 = Light::Moon;
    let air = SkyConditions { sky_mag_arcsec2: 19.4, extinction_mag: 0.0 };
    let exposure = sensor.expose(&image, 30.0, &air, (0.0, 0.0)).unwrap();
    let sets = [vec![Light::Moon], vec![Light::Starlight]];
    let got = signal_to_noise(&exposure, sensor.gain.read_noise_e, &sets);
    for ratio in [got[0].pixel / got[1].pixel, got[0].summed / got[1].summed, got[0].matched / got[1].matched] {
        assert!(ratio <= 294.0 * (1.0 + 1e-9), "{ratio}");
    }
}
