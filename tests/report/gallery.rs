//! The gallery: one file, worst first, pixels as measured, nothing a header says is taken for HTML.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::support;

use base64::Engine;
use satphot::figures::Thumb;
use satphot::figures::thumb::{GREYS, MARKS_RGB, MASKED, OUTSIDE, SATURATED};
use satphot::photometry::Flags;
use satphot::report::gallery::worst_first;
use satphot::report::write_gallery;
use satphot::tables::PhotometryRow;

fn thumb() -> Thumb {
    // 3 x 2 pixels, the lower row black to white, the upper one the three marks
    let levels = vec![0, 20, GREYS - 1, MASKED, SATURATED, OUTSIDE];
    Thumb { width: 3, height: 2, bin: 1, x0: 10, y0: 20, search_px: None, levels }
}

fn row(frame: &str, verdict: &str) -> PhotometryRow {
    PhotometryRow {
        frame: frame.into(),
        object_name: "ISS".into(),
        date_mid: "2025-06-09T10:33:02.500Z".into(),
        x_px: Some(11.0),
        y_px: Some(20.0),
        aper_shape: "circle".into(),
        aper_r_px: Some(1.0),
        snr: Some(10.0),
        v_mag: Some(11.93),
        v_mag_err: Some(0.05),
        alt_deg: Some(47.0),
        pix_scale_arcsec: Some(0.196),
        status: "ok".into(),
        verdict: verdict.into(),
        ..PhotometryRow::default()
    }
}

fn failed(frame: &str, reason: &str) -> PhotometryRow {
    PhotometryRow {
        frame: frame.into(),
        status: "failed".into(),
        verdict: "reject".into(),
        reason: reason.into(),
        ..PhotometryRow::default()
    }
}

/// The page made of rows that all have the same picture; failed ones have none.
fn page(rows: &[PhotometryRow], most: usize) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("gallery.html");
    let thumbs: Vec<Option<Thumb>> = rows.iter().map(|r| (r.status != "failed").then(thumb)).collect();
    write_gallery(&path, rows, &thumbs, "2025-06-09", (most, "V")).unwrap();
    std::fs::read_to_string(path).unwrap()
}

/// Frame names in the order of the page.
fn frames_of(page: &str) -> Vec<String> {
    page.split("<h3>").skip(1).map(|card| card.split("</h3>").next().unwrap().to_string()).collect()
}

#[test]
fn the_worst_frame_comes_first_and_a_failed_one_before_it() {
    let mut rows = vec![row("use", "use"), row("caution", "caution"), row("reject", "reject"), failed("failed", "")];
    rows.push(PhotometryRow { contam_frac: Some(0.3), ..row("contaminated", "caution") });
    rows.push(PhotometryRow { snr: Some(3.0), ..row("faint", "caution") });
    let order: Vec<&str> = worst_first(&rows).into_iter().map(|i| rows[i].frame.as_str()).collect();
    assert_eq!(order, ["failed", "reject", "contaminated", "faint", "caution", "use"]);
    // whatever the order they come in
    rows.reverse();
    let order: Vec<&str> = worst_first(&rows).into_iter().map(|i| rows[i].frame.as_str()).collect();
    assert_eq!(order, ["failed", "reject", "contaminated", "faint", "caution", "use"]);
    let page = page(&rows, 500);
    assert_eq!(frames_of(&page), ["reject", "contaminated", "faint", "caution", "use"]);
    assert!(page.find("Not measured").unwrap() < page.find("<h3>").unwrap());
    assert!(page.contains("5 target frames: 1 use, 3 caution, 1 reject; 1 not measured"), "{page}");
}

#[test]
fn at_most_so_many_pictures_are_shown_and_they_are_the_worst() {
    let rows: Vec<PhotometryRow> =
        (0..30).map(|k| row(&format!("f{k:02}"), if k % 10 == 3 { "reject" } else { "use" })).collect();
    let page = page(&rows, 4);
    assert_eq!(frames_of(&page), ["f03", "f13", "f23", "f00"]);
    assert!(page.contains("The worst 4 are shown."));
}

#[test]
fn a_picture_has_the_pixels_of_the_frame_with_marks_in_colour() {
    let page = page(&[row("f", "use")], 10);
    let data = page.split("data:image/png;base64,").nth(1).unwrap().split('"').next().unwrap();
    let bytes = base64::engine::general_purpose::STANDARD.decode(data).unwrap();
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.width, info.height, info.color_type), (3, 2, png::ColorType::Rgb));
    // the upper row of the frame is the first of the file
    let [masked, saturated, outside] = MARKS_RGB;
    let grey = 20 * 255 / (GREYS - 1) as u16;
    let expected = [masked, saturated, outside, [0; 3], [grey as u8; 3], [255; 3]].concat();
    assert_eq!(pixels[..18], expected);
    assert!(page.contains("image-rendering: pixelated"));
}

#[test]
fn what_a_hostile_header_says_is_text_and_never_html() {
    let evil = r#""><script>alert(1)</script><img src=x onerror='alert(2)'>&amp;"#;
    let mut row = row(evil, evil);
    (row.object_name, row.reason, row.date_mid, row.aper_shape) = (evil.into(), evil.into(), evil.into(), evil.into());
    let page = {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("gallery.html");
        write_gallery(&path, &[row, failed(evil, evil)], &[Some(thumb())], evil, (10, "V")).unwrap();
        std::fs::read_to_string(path).unwrap()
    };
    assert_eq!(page.matches("<script>").count(), 1, "only our own");
    assert!(!page.contains("<img src=x") && page.contains("&lt;script&gt;alert(1)"));
    // no attribute was left: every quote of the header is escaped
    assert!(!page.contains(r#"="">"#) && !page.contains(r#""><script"#));
}

#[test]
fn the_page_needs_no_other_file_and_no_network() {
    let page = page(&[row("f", "use"), failed("g", "truncated file")], 10);
    for word in ["http://", "https://", "src=\"/", "href=", "@import", "url("] {
        assert!(!page.contains(word), "{word}");
    }
    for word in
        ["<!DOCTYPE html>", "lang=\"en\"", "prefers-color-scheme", "@media print", "alt=\"f: ", "truncated file"]
    {
        assert!(page.contains(word), "{word}");
    }
}

#[test]
fn a_card_shows_the_magnitude_the_verdict_every_reason_and_the_flags() {
    let mut rows = vec![row("a", "caution"), row("b", "use")];
    rows[0].reason = "star trail adds 12 % of the flux (contaminated); elements 3.0 d old (old_elements)".into();
    rows[0].flags = Flags::CONTAMINATED.0 | Flags::LOWER_LIMIT.0;
    (rows[1].v_mag, rows[1].limit_v_mag, rows[1].status) = (None, Some(14.2), "nondetection".into());
    let page = page(&rows, 10);
    for word in [
        "<li>star trail adds 12 % of the flux (contaminated)</li><li>elements 3.0 d old (old_elements)</li>",
        "11.930 ± 0.050 or brighter",
        "flags: contaminated, lower_limit",
        r#" class="card caution""#,
        r#"<span class="badge caution">"#,
        "fainter than 14.20",
        "2025-06-09 10:33:02.50",
    ] {
        assert!(page.contains(word), "{word}");
    }
}

#[test]
fn a_limit_and_an_instrumental_magnitude_are_not_ordered_among_magnitudes() {
    let limit =
        PhotometryRow { v_mag: None, limit_v_mag: Some(12.03), status: "nondetection".into(), ..row("a", "use") };
    let instrumental = PhotometryRow { v_mag: None, inst_mag: Some(-11.4), ..row("b", "use") };
    let page = page(&[limit, instrumental, row("c", "use")], 10);
    // what has no value for the order comes last
    assert_eq!(page.matches("data-mag=").count(), 1);
    assert!(page.contains("data-mag=\"11.93\"") && page.contains("fainter than 12.03"));
}

#[test]
fn a_night_writes_its_gallery_the_same_bytes_for_one_thread_and_for_two() {
    let folder = support::simulated("gallery", &[]);
    let mut night = support::Night::copy_of(&folder);
    night.options.no_figures = false;
    night.sets.push("vetting.gallery_frames=4".into());
    std::fs::write(night.path("target_0002.fits"), "not a FITS file").unwrap();
    night.options.jobs = 1;
    night.run().unwrap();
    let one = night.text("gallery.html");
    night.options.jobs = 2;
    night.run().unwrap();
    assert!(one == night.text("gallery.html"));
    assert_eq!(one.matches("data:image/png;base64,").count(), 4, "the worst four of five");
    assert!(one.contains("target_0002.fits") && one.find("target_0002.fits") < one.find("data:image/png"));
    // none wanted, none written
    std::fs::remove_file(night.result("gallery.html")).unwrap();
    night.sets.push("vetting.gallery_frames=0".into());
    night.run().unwrap();
    assert!(!night.result("gallery.html").exists());
}
