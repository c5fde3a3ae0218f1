//! What taints a row: a bit mask that travels with every flux.

use serde::Deserialize;
use serde::Serialize;
use std::fmt;

/// Quality bits of a measurement; the names are written in the meta of every table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
pub struct Flags(pub i32);

impl Flags {
    /// A pixel at or above saturation inside the aperture (in any member of a combined star).
    pub const SATURATED: Flags = Flags(1);
    /// A masked or NaN pixel inside the aperture, filled from its neighbours, or with the mean of the aperture where they are bad too.
    pub const MASKED: Flags = Flags(1 << 1);
    /// The aperture reaches over the edge of the frame.
    pub const EDGE: Flags = Flags(1 << 2);
    /// The aperture or the annulus reaches outside the clip circle.
    pub const CLIP_EDGE: Flags = Flags(1 << 3);
    /// The net flux is not positive.
    pub const NEGATIVE: Flags = Flags(1 << 4);
    /// Many annulus pixels were clipped: a neighbour or a trail lies in it.
    pub const CROWDED_ANNULUS: Flags = Flags(1 << 5);
    /// No usable annulus: the background mesh was used instead.
    pub const NO_ANNULUS: Flags = Flags(1 << 6);
    /// The aperture holds light of another catalogue star, more than 0.3 of the flux error; or the match with the
    /// catalogue is ambiguous: a second star fits the image, or another one bright enough to matter claims it too.
    pub const NEIGHBOUR: Flags = Flags(1 << 7);
    /// The target is elongated (smear, rotation or its own shape).
    pub const ELONGATED: Flags = Flags(1 << 8);
    /// A star trail crosses the aperture.
    pub const TRAIL: Flags = Flags(1 << 9);
    /// No master flat was applied.
    pub const NO_FLAT: Flags = Flags(1 << 10);
    /// The elements are more than 2 days old.
    pub const OLD_ELEMENTS: Flags = Flags(1 << 11);
    /// The mid-exposure time is uncertain by a second or more.
    pub const TIME_UNCERTAIN: Flags = Flags(1 << 12);
    /// A model input was extrapolated (lunar phase law beyond 150 degrees).
    pub const MODEL_EXTRAPOLATED: Flags = Flags(1 << 13);

    /// A star trail or a neighbour adds more than `vetting.contam_caution_frac` of the target's flux.
    pub const CONTAMINATED: Flags = Flags(1 << 14);
    /// The target is smeared: longer than the point-spread function and its own size explain.
    pub const SMEARED: Flags = Flags(1 << 15);
    /// The background falls off towards the corners otherwise than in the neighbouring frames: something in the beam.
    pub const VIGNETTED: Flags = Flags(1 << 16);
    /// A cosmic ray or hot pixel inside the aperture.
    pub const HIT: Flags = Flags(1 << 17);
    /// The dome may have cut the beam: the brightness is a lower limit.
    pub const LOWER_LIMIT: Flags = Flags(1 << 18);
    /// The cadence contradicts the exposure time.
    pub const EXPTIME_DOUBTED: Flags = Flags(1 << 19);
    /// Below the altitude the dome allows.
    pub const LOW_ALTITUDE: Flags = Flags(1 << 20);
    /// The zeropoint is that of another night.
    pub const OTHER_ZEROPOINT: Flags = Flags(1 << 21);
    /// The header's world coordinates were absent or wrong and have been replaced.
    pub const WCS_REPLACED: Flags = Flags(1 << 22);
    /// A satellite or an aircraft crosses the target: a trail in another direction than the stars'.
    pub const CROSSED: Flags = Flags(1 << 23);
    /// Where nothing was found: what stood out is charge that spilt along columns or rows from saturated pixels.
    pub const BLOOMING: Flags = Flags(1 << 24);

    /// The stars that trail through the frame are fainter than the zeropoint says, by more than three errors.
    pub const CLOUD: Flags = Flags(1 << 25);
    /// No other frame of the pass shows anything at the place of this detection, though they show the target elsewhere, or most of
    /// them nothing.
    pub const UNCONFIRMED: Flags = Flags(1 << 26);

    /// Every bit with its name, in order.
    pub const NAMES: [(Flags, &'static str); 27] = [
        (Self::SATURATED, "saturated"),
        (Self::MASKED, "masked"),
        (Self::EDGE, "edge"),
        (Self::CLIP_EDGE, "clip_edge"),
        (Self::NEGATIVE, "negative"),
        (Self::CROWDED_ANNULUS, "crowded_annulus"),
        (Self::NO_ANNULUS, "no_annulus"),
        (Self::NEIGHBOUR, "neighbour"),
        (Self::ELONGATED, "elongated"),
        (Self::TRAIL, "trail"),
        (Self::NO_FLAT, "no_flat"),
        (Self::OLD_ELEMENTS, "old_elements"),
        (Self::TIME_UNCERTAIN, "time_uncertain"),
        (Self::MODEL_EXTRAPOLATED, "model_extrapolated"),
        (Self::CONTAMINATED, "contaminated"),
        (Self::SMEARED, "smeared"),
        (Self::VIGNETTED, "vignetted"),
        (Self::HIT, "hit"),
        (Self::LOWER_LIMIT, "lower_limit"),
        (Self::EXPTIME_DOUBTED, "exptime_doubted"),
        (Self::LOW_ALTITUDE, "low_altitude"),
        (Self::OTHER_ZEROPOINT, "other_zeropoint"),
        (Self::WCS_REPLACED, "wcs_replaced"),
        (Self::CROSSED, "crossed"),
        (Self::BLOOMING, "blooming"),
        (Self::CLOUD, "cloud"),
        (Self::UNCONFIRMED, "unconfirmed"),
    ];

    /// Sets the bits of `other`.
    pub fn set(&mut self, other: Flags) {
        self.0 |= other.0;
    }
    /// Whether every bit of `other` is set.
    #[must_use]
    pub fn has(self, other: Flags) -> bool {
        self.0 & other.0 == other.0
    }
    /// Whether any bit of `other` is set.
    #[must_use]
    pub fn any(self, other: Flags) -> bool {
        self.0 & other.0 != 0
    }
}

impl std::ops::BitOr for Flags {
    type Output = Flags;
    fn bitor(self, o: Flags) -> Flags {
        Flags(self.0 | o.0)
    }
}

impl fmt::Display for Flags {
    /// The names joined by `+`, or nothing.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = Self::NAMES.iter().filter(|(b, _)| self.has(*b)).map(|(_, n)| *n).collect();
        f.write_str(&names.join("+"))
    }
}
