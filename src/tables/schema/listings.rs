//! Tables that are printed as CSV alone: their names of columns come from here, their lines are written where they are made.

use super::define::table;

table! {
    SEEN = "seen.csv", "One row per satellite above the horizon and moment, of `predict constellation`, each satellite by itself.";
    columns {
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// number of the satellite: in the catalogue, or in the constellation from 0
        number: i64,
        /// altitude above the horizon, without refraction
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: f64 => "deg" ["pos.az.azi"],
        /// distance from the observer
        range_km: f64 => "km" ["pos.distance"],
        /// modelled V magnitude, all lights
        model_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by direct sunlight alone
        sun_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by sunlight from the Earth alone
        earthshine_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by direct moonlight alone
        moon_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// modelled V magnitude by moonlight from the Earth alone
        lunar_earthshine_v_mag: f64 => "mag" ["phot.mag;em.opt.V;meta.modelled"],
        /// numerical error of model_v_mag (quadrature); not how wrong the model is
        model_err_mag: f64 => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// 1-sigma error of model_v_mag as a prediction: scatter of observations about the model, its fitted parameters, extinction;
        /// missing where the model was not compared with observations
        v_pred_err_mag: Option<f64> => "mag" ["stat.error;phot.mag;em.opt.V;meta.modelled"],
        /// lights that were not computed because they cannot change model_v_mag by more than a quarter of the tolerance, names with "; "
        /// between; their columns are empty
        too_faint: String => ["meta.note"],
    }
}

table! {
    PASSES = "passes.csv", "One row per pass of `passes`, as comma-separated values.";
    columns {
        /// UTC of the rise, ISO 8601; empty where the satellite does not rise
        rise_utc: String,
        /// UTC of the culmination, ISO 8601; empty where there is none
        culmination_utc: String,
        /// UTC of the set, ISO 8601; empty where the satellite does not set
        set_utc: String,
        /// azimuth of the rise from north through east
        rise_az_deg: f64 => "deg",
        /// altitude of the culmination, without refraction
        max_alt_deg: f64 => "deg",
        /// azimuth of the culmination from north through east
        max_az_deg: f64 => "deg",
        /// azimuth of the set from north through east
        set_az_deg: f64 => "deg",
        /// distance from the observer at the culmination
        range_km: f64 => "km" ["pos.distance"],
        /// altitude of the Sun at the observer, at the culmination
        sun_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// altitude of the Moon at the observer, at the culmination
        moon_alt_deg: f64 => "deg" ["pos.az.alt"],
        /// illuminated fraction of the lunar disc
        moon_illum_pct: f64 => "%" ["phys.area;arith.ratio"],
        /// largest lights of rise, culmination and set, in order
        illum: String => ["meta.code"],
        /// where the Sun stands for the observer: day, civil_, nautical_ or astronomical_twilight, night
        sky_class: String => ["meta.code"],
        /// day, twilight or night, as Caddy et al. label a pass
        paper_label: String => ["meta.code"],
        /// which of rise, culmination and set are outside the window
        outside_window: String,
        /// what must be known of the pass
        note: String,
    }
}

table! {
    FLUX_MAP = "flux.csv", "One row per direction of the flux map of `predict sky`.";
    columns {
        /// altitude above the horizon, without refraction
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// azimuth from north through east
        az_deg: f64 => "deg" ["pos.az.azi"],
        /// irradiance at the observer by all lights, in units of the Sun's at 1 au as the model scales it
        flux: f64,
    }
}

table! {
    EXPLICIT = "geometry.csv", "One row per case of `predict geometry`.";
    columns {
        /// name of the case
        id: String,
        /// irradiance at the observer by direct light, in units of the light's own at the satellite
        direct_per_E0: f64,
        /// irradiance at the observer by light from the Earth, in the same units
        earth_per_E0: f64,
        /// estimated numerical error of earth_per_E0
        earth_err_est: f64,
        /// points at which the integrand was computed
        nodes: i64,
        /// what the model skipped, and why
        skipped: String => ["meta.note"],
        /// what must be known of the case, or why it was not computed
        warn: String,
    }
}

table! {
    SED = "sed.csv", "One row per source of light and phase of the Moon of `predict sed`, as comma-separated values.";
    columns {
        /// source of light
        source: String,
        /// phase angle of the Moon, 0 = full; empty for the Sun
        phase_deg: f64 => "deg",
        /// V magnitude
        v_mag: f64 => "mag" ["phot.mag;em.opt.V"],
        /// irradiance in the band
        band_w_m2: f64 => "W m-2",
        /// irradiance from 300 to 1050 nm
        w_m2_300_1050: f64 => "W m-2",
    }
}

table! {
    SATELLITES = "satellites.csv", "One row per satellite of `satellites`, as comma-separated values.";
    columns {
        /// name by which the model knows it
        name: String,
        /// what it is
        title: String,
        /// area of all surfaces
        area_m2: f64 => "m2",
        /// names of the surfaces
        surfaces: String,
        /// heights of its orbits
        orbits: String,
        /// satellites launched
        launched: i64,
        /// satellites planned
        planned: i64,
        /// where the areas are from
        area_source: String,
        /// scatter of the observations about the model [mag], or that there is no comparison
        scatter_mag: String,
        /// what observations say against the model
        caveat: String,
    }
}

table! {
    SURFACES = "surfaces.csv", "One row per surface of one satellite of `satellites`, as comma-separated values.";
    columns {
        /// name of the surface
        surface: String,
        /// its area
        area_m2: f64 => "m2",
        /// how it is turned
        attitude: String,
        /// scattering law of the front
        brdf: String,
        /// share of the light it reflects at normal incidence
        reflectance_0deg: f64,
        /// share of the light it reflects at 60 deg of incidence
        reflectance_60deg: f64,
        /// scattering law of the back, or black
        back: String,
    }
}

table! {
    BRDF_CURVE = "brdf.csv", "Scattered light by direction, and then reflectances, of `brdf plot`, as comma-separated values.";
    columns {
        /// angle of incidence
        incidence_deg: f64 => "deg",
        /// angle of the outgoing light in the plane of incidence; empty in rows of reflectances
        outgoing_deg: f64 => "deg",
        /// scattering law; empty in rows of reflectances
        f_per_sr: f64 => "1 / sr",
        /// share of the light that is reflected in all directions
        reflectance: f64,
    }
}

table! {
    STRIP = "strip.csv", "One row per picture of a pass of `render`, as comma-separated values.";
    columns {
        /// UTC, ISO 8601
        date_mid: String => ["time.epoch;obs"],
        /// altitude above the horizon, without refraction
        alt_deg: f64 => "deg" ["pos.az.alt"],
        /// distance from the observer
        range_km: f64 => "km" ["pos.distance"],
        /// V magnitude of what is in the picture
        v_mag: f64 => "mag" ["phot.mag;em.opt.V"],
        /// source of light that gives most of it
        brightest_light: String,
        /// its share of all light
        share_pct: f64 => "%",
        /// whether the picture holds the whole satellite
        whole_satellite: String,
    }
}

table! {
    AREAS = "areas.csv", "One row per part of a satellite of the areas of `render`, as comma-separated values, and their total.";
    columns {
        /// part of the satellite
        part: String,
        /// number of components it has
        components: i64,
        /// its area seen at right angles
        broadside_m2: f64 => "m2",
        /// its area seen from nadir
        from_nadir_m2: f64 => "m2",
        /// its area in the catalogue of satellites
        catalogue_m2: f64 => "m2",
        /// how far broadside_m2 is from it
        off_pct: f64 => "%",
    }
}

table! {
    PAPER_STEPS = "case.csv", "One row per quantity of the rendered case of the paper, of `render`, as comma-separated values.";
    columns {
        /// what it is
        quantity: String,
        /// unit of the values of this row
        unit: String,
        /// what it is of
        of: String,
        /// by starlight alone
        starlight: f64,
        /// by starlight and moonlight
        with_moonlight: f64,
        /// by starlight, moonlight and moonlight from the Earth
        with_lunar_earthshine: f64,
        /// all lights over starlight
        all_over_starlight: f64,
    }
}
