//! What is written of a picture: FITS, PNG, table.

use ndarray::Array2;
use satphot::base::time::iso_utc;
use satphot::brightness::light_sources::mag_of_flux;
use satphot::config::Site;
use satphot::figures::radiance::fits::{PictureFacts, write_picture};
use satphot::figures::radiance::picture::{Tile, write_preview, write_sheet};
use satphot::orbit::Geometry;
use satphot::resolved::{ComponentSatellite, RadianceImage, RenderSettings, Rendered};
use satphot::tables::{Meta, MetaValue, RadianceRow, write_rows};

use super::super::tell;
use super::files::Files;

/// What is looked at, and from where.
pub struct Target<'a> {
    pub satellite: &'a ComponentSatellite,
    /// Name and number of the elements, e.g. `ISS (ZARYA) [25544]`.
    pub object: String,
    pub norad_cat_id: u64,
    pub site: &'a Site,
    pub geometry: &'a Geometry,
}

/// A picture and all that is reported of it.
pub struct RenderedPicture<'a> {
    pub of: &'a Target<'a>,
    pub rendered: &'a Rendered,
    pub rows: &'a [RadianceRow],
    pub settings: &'a RenderSettings,
}

impl RenderedPicture<'_> {
    /// Writes the picture to its files.
    pub fn write(&self, files: &Files, quiet: bool) -> anyhow::Result<()> {
        let (image, g) = (&self.rendered.image, self.of.geometry);
        let facts = PictureFacts {
            object: self.of.object.clone(),
            norad_cat_id: Some(self.of.norad_cat_id),
            site: Some([self.of.site.lat_deg, self.of.site.lon_deg, self.of.site.alt_m]),
            date_mid: iso_utc(g.epoch, 3),
            v_mag: v_of(self.rendered),
            part: !self.rendered.whole,
            alt_az_deg: Some((g.alt_rad.to_degrees(), g.az_rad.to_degrees())),
            comments: self.history(),
        };
        for path in &files.picture.fits {
            write_picture(path, image, &facts)?;
        }
        for path in &files.picture.png {
            write_preview(path, &tile(image, total(image), self.captions()))?;
        }
        if let Some(path) = &files.lights_png {
            self.write_lights(path)?;
        }
        for path in &files.picture.ecsv {
            write_rows(path, self.rows, &self.meta("satphot.radiance/1"))?;
        }
        let written = files.picture.fits.iter().chain(&files.picture.png).chain(&files.lights_png);
        let written = written.chain(&files.picture.ecsv);
        written.filter(|_| !quiet).for_each(|file| tell(&format!("wrote {}", file.display())));
        Ok(())
    }

    /// One panel for each light.
    fn write_lights(&self, path: &std::path::Path) -> anyhow::Result<()> {
        let image = &self.rendered.image;
        let panel = |name: &str, v_flux: f64, plane: Array2<f64>| {
            let v = v_text(mag_of_flux(v_flux), self.rendered.whole);
            let captions = std::iter::once(format!("{name}  {v}")).chain(peak(&plane, image)).collect();
            tile(image, plane, captions)
        };
        let fluxes = &self.rendered.v_flux;
        let mut tiles = vec![panel("all lights", fluxes.iter().map(|(_, v)| v).sum(), total(image))];
        for (light, plane) in &image.planes {
            let v_flux = fluxes.iter().filter(|(l, _)| l == light).map(|(_, v)| v).sum();
            tiles.push(panel(light.title(), v_flux, plane.clone()));
        }
        Ok(write_sheet(path, &self.heading(), &tiles, 3)?)
    }

    /// Lines a reader of a file should know.
    pub fn history(&self) -> Vec<String> {
        let satellite = self.of.satellite;
        let first = [satellite.title.clone()].into_iter().chain(satellite.notes.iter().cloned());
        first.chain(laws(satellite)).chain(self.rendered.warnings.iter().cloned()).collect()
    }

    pub fn heading(&self) -> String {
        let time = iso_utc(self.of.geometry.epoch, 0);
        format!("{}  {} UTC", self.of.satellite.name, time.trim_end_matches('Z'))
    }

    fn captions(&self) -> Vec<String> {
        let g = self.of.geometry;
        let v = v_text(v_of(self.rendered), self.rendered.whole);
        let place = format!("{:.0} km, altitude {:.1} deg", g.range_km, g.alt_rad.to_degrees());
        let image = &self.rendered.image;
        [self.heading(), format!("{v}  {place}")].into_iter().chain(peak(&total(image), image)).collect()
    }

    /// The meta block of a table of this picture.
    pub fn meta(&self, schema: &str) -> Meta {
        let (g, s, image) = (self.of.geometry, self.settings, &self.rendered.image);
        let mut meta = Meta::default();
        meta.push("schema", schema);
        meta.push("satellite", self.of.satellite.name.clone());
        meta.push("object_name", self.of.object.clone());
        meta.push("norad_cat_id", self.of.norad_cat_id as f64);
        let Site { lat_deg, lon_deg, alt_m, .. } = *self.of.site;
        let site = [("lat_deg", lat_deg), ("lon_deg", lon_deg), ("alt_m", alt_m)];
        let site = site.map(|(key, value)| (key.to_owned(), MetaValue::Number(value)));
        meta.push("site", MetaValue::Map(site.to_vec()));
        meta.push("date_mid", iso_utc(g.epoch, 3));
        meta.push("range_km", g.range_km);
        meta.push("alt_deg", g.alt_rad.to_degrees());
        meta.push("az_deg", g.az_rad.to_degrees());
        meta.push("band_low_um", image.band_um.0);
        meta.push("band_high_um", image.band_um.1);
        meta.push("pixel_arcsec", image.pixel_rad.to_degrees() * 3600.0);
        meta.push("pixels", s.pixels as f64);
        meta.push("samples", s.samples as f64);
        meta.push("earth_rays", s.earth_rays as f64);
        meta.push("seen_area_m2", self.rendered.seen_area_m2);
        let part = "no: it reaches beyond the picture; the rows of place picture are of the part in it";
        meta.push("whole_satellite", if self.rendered.whole { "yes" } else { part });
        meta.push("convex", if self.rendered.convex { "yes: no shadow rays needed" } else { "no" });
        match s.uniform_earth_w_cm2_sr_um {
            Some(l) => meta.push("uniform_earth_w_cm2_sr_um", l),
            None => meta.push("earth", format!("{:?}", s.model.earth)),
        }
        if let Some(source) = self.of.satellite.sources.get("scattering") {
            meta.push("scattering", source.clone());
        }
        let warnings = self.rendered.warnings.iter().cloned().map(MetaValue::Text).collect();
        meta.push("warnings", MetaValue::List(warnings));
        meta
    }
}

/// Where the laws of a satellite are from.
pub fn laws(satellite: &ComponentSatellite) -> Option<String> {
    satellite.sources.get("scattering").map(|source| format!("scattering: {source}"))
}

/// Sum of the lights.
pub fn total(image: &RadianceImage) -> Array2<f64> {
    let shape = image.planes.first().map_or((0, 0), |(_, plane)| plane.dim());
    image.planes.iter().fold(Array2::zeros(shape), |sum, (_, plane)| sum + plane)
}

/// V of all lights.
pub fn v_of(rendered: &Rendered) -> Option<f64> {
    mag_of_flux(rendered.v_flux.iter().map(|(_, v)| v).sum())
}

/// V for a caption; that of a part says so.
pub fn v_text(v_mag: Option<f64>, whole: bool) -> String {
    match v_mag {
        None => "no light".into(),
        Some(v) if whole => format!("V {v:.2}"),
        Some(v) => format!("V {v:.2} (part)"),
    }
}

/// A picture with its scales.
pub fn tile(image: &RadianceImage, radiance: Array2<f64>, captions: Vec<String>) -> Tile {
    Tile {
        radiance,
        captions,
        pixel_m: image.pixel_rad * image.range_km * 1e3,
        pixel_arcsec: image.pixel_rad.to_degrees() * 3600.0,
        white: None,
    }
}

/// The radiance shown white, and its band; nothing for a dark picture.
pub fn peak(plane: &Array2<f64>, image: &RadianceImage) -> Option<String> {
    let white = plane.iter().copied().fold(0.0, f64::max);
    let (low, high) = image.band_um;
    (white > 0.0).then(|| format!("white {white:.2e} W/m2/sr  {low:.2}-{high:.2} um"))
}
