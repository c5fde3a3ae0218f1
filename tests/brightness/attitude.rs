//! How surfaces are held: unit normals, limits, symmetries, and the published convention of the Sun's azimuth.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::f64::consts::PI;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use satphot::base::vector::{Itrs, Vector};
use satphot::brightness::{Attitude, Brdf, Scene, Surface};
use satphot::config;

type V = Vector<Itrs>;
const AU_KM: f64 = 149_597_870.7;

fn on_sphere(rng: &mut ChaCha8Rng) -> V {
    let (z, turn): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(0.0..2.0 * PI));
    let across = (1.0 - z * z).sqrt();
    V::new(across * turn.cos(), across * turn.sin(), z)
}

/// A satellite above the z axis that flies along x; the Sun in a direction as the satellite sees it.
fn scene(sun: V) -> Scene {
    let satellite_km = V::new(0.0, 0.0, 6900.0);
    Scene {
        satellite_km,
        velocity_km_s: V::new(7.6, 0.0, 0.0),
        observer_km: V::new(0.0, 0.0, 6378.0),
        sun_km: satellite_km + sun * AU_KM,
        moon_km: V::new(0.0, 3.8e5, 0.0),
        sidereal_rad: 0.7,
    }
}

fn anywhere(rng: &mut ChaCha8Rng) -> Scene {
    let satellite_km = on_sphere(rng) * rng.random_range(6600.0..42_000.0);
    Scene {
        satellite_km,
        velocity_km_s: on_sphere(rng) * 7.0,
        observer_km: satellite_km.unit().unwrap() * 6378.0,
        sun_km: on_sphere(rng) * AU_KM,
        moon_km: on_sphere(rng) * 4e5,
        sidereal_rad: rng.random_range(0.0..2.0 * PI),
    }
}

/// Every attitude that has no frame of its own.
fn held_by_the_orbit() -> Vec<Attitude> {
    vec![
        Attitude::Nadir,
        Attitude::Sun,
        Attitude::SunAzimuth,
        Attitude::SunToNadir,
        Attitude::SunOneAxis { axis_lvlh: [0.0, 1.0, 0.0], zero_lvlh: [0.0, 0.0, -2.0], limit_rad: PI },
        Attitude::SunOneAxis { axis_lvlh: [1.0, 0.3, 0.0], zero_lvlh: [0.0, 0.0, 1.0], limit_rad: 0.5 },
        Attitude::SunTwoAxes { azimuth_limit_rad: PI, elevation_rad: [-PI / 2.0, PI / 2.0] },
        Attitude::SunTwoAxes { azimuth_limit_rad: 0.9, elevation_rad: [-0.2, 0.6] },
        Attitude::Lvlh([0.3, -0.4, 2.0]),
    ]
}

fn normal(attitude: Attitude, scene: &Scene) -> V {
    attitude.normal(scene).unwrap()
}

fn close(a: V, b: V, tolerance: f64) -> bool {
    (a - b).norm() <= tolerance
}

#[test]
fn every_normal_is_a_unit_vector_in_any_scene() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut attitudes = held_by_the_orbit();
    attitudes.push(Attitude::Inertial { ra_rad: 1.0, dec_rad: -0.4 });
    attitudes.push(Attitude::Fixed(V::new(3.0, 4.0, 0.0)));
    for _ in 0..500 {
        let s = anywhere(&mut rng);
        for attitude in &attitudes {
            assert!((normal(*attitude, &s).norm() - 1.0).abs() < 1e-14, "{attitude:?}");
        }
    }
}

#[test]
fn turning_the_whole_scene_turns_every_normal_with_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for _ in 0..200 {
        let s = anywhere(&mut rng);
        let a = on_sphere(&mut rng);
        let b = a.any_perpendicular().unwrap();
        let c = a.cross(&b);
        let turn = |v: V| a * v.x() + b * v.y() + c * v.z();
        let turned = Scene {
            satellite_km: turn(s.satellite_km),
            velocity_km_s: turn(s.velocity_km_s),
            observer_km: turn(s.observer_km),
            sun_km: turn(s.sun_km),
            moon_km: turn(s.moon_km),
            ..s
        };
        for attitude in held_by_the_orbit() {
            let (before, after) = (normal(attitude, &s), normal(attitude, &turned));
            // rounding alone; near a singular direction it is magnified by at most the distance to it
            assert!(close(turn(before), after, 1e-12), "{attitude:?} {before:?} {after:?}");
        }
    }
}

#[test]
fn the_stars_stay_where_they_are_while_the_earth_turns_under_them() {
    let s = scene(V::new(0.0, 1.0, 0.0));
    let at = |sidereal_rad: f64| normal(Attitude::Inertial { ra_rad: 1.2, dec_rad: 0.3 }, &Scene { sidereal_rad, ..s });
    // at sidereal time = right ascension the star is over the x axis; an hour later it has moved 15 deg west
    assert!(close(at(1.2), V::new(0.3_f64.cos(), 0.0, 0.3_f64.sin()), 1e-15));
    let west = -15_f64.to_radians();
    let later = V::new(0.3_f64.cos() * west.cos(), 0.3_f64.cos() * west.sin(), 0.3_f64.sin());
    assert!(close(at(1.2 + 15_f64.to_radians()), later, 1e-15));
}

#[test]
fn lvlh_is_forward_against_the_angular_momentum_and_down() {
    let s = scene(V::new(0.0, 1.0, 0.0));
    // above +z along +x: r × v is +y
    assert!(close(normal(Attitude::Lvlh([1.0, 0.0, 0.0]), &s), V::new(1.0, 0.0, 0.0), 1e-15));
    assert!(close(normal(Attitude::Lvlh([0.0, 1.0, 0.0]), &s), V::new(0.0, -1.0, 0.0), 1e-15));
    assert!(close(normal(Attitude::Lvlh([0.0, 0.0, 1.0]), &s), normal(Attitude::Nadir, &s), 1e-15));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..100 {
        let s = anywhere(&mut rng);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|v| normal(Attitude::Lvlh(v), &s));
        assert!(close(x.cross(&y), z, 1e-12) && x.dot(&y).abs().max(y.dot(&z).abs()) < 1e-12);
        assert!(x.dot(&s.velocity_km_s) > 0.0 && y.dot(&s.velocity_km_s).abs() < 1e-9);
    }
}

#[test]
fn the_suns_azimuth_is_the_y_axis_of_the_published_brightness_frame() {
    // lumos-sat: z from the Earth's centre to the satellite, the source at (0, cos a, −sin a), the panel's normal +y
    for past_terminator_deg in [-80.0_f64, -10.0, 0.0, 10.0, 20.0, 89.0] {
        let (sin, cos) = past_terminator_deg.to_radians().sin_cos();
        let got = normal(Attitude::SunAzimuth, &scene(V::new(0.0, cos, -sin)));
        assert!(close(got, V::new(0.0, 1.0, 0.0), 1e-12), "{past_terminator_deg} {got:?}");
    }
}

#[test]
fn one_axis_at_right_angles_to_the_sun_and_two_free_axes_point_at_the_sun() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..200 {
        let elevation = rng.random_range(-1.5..1.5_f64);
        // the Sun in the orbital plane, the axis across it
        let s = scene(V::new(elevation.cos(), 0.0, elevation.sin()));
        let one = Attitude::SunOneAxis { axis_lvlh: [0.0, 3.0, 0.0], zero_lvlh: [0.0, 0.0, 1.0], limit_rad: PI };
        assert!(close(normal(one, &s), normal(Attitude::Sun, &s), 1e-12));
        let s = anywhere(&mut rng);
        let two = Attitude::SunTwoAxes { azimuth_limit_rad: PI, elevation_rad: [-PI / 2.0, PI / 2.0] };
        assert!(close(normal(two, &s), normal(Attitude::Sun, &s), 1e-12));
    }
}

#[test]
fn no_other_position_within_the_limits_is_nearer_to_the_sun() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..300 {
        let s = anywhere(&mut rng);
        let sun = normal(Attitude::Sun, &s);
        let limit_rad = rng.random_range(0.05..PI);
        let (axis_lvlh, zero_lvlh) = ([0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]);
        let best = normal(Attitude::SunOneAxis { axis_lvlh, zero_lvlh, limit_rad }, &s).dot(&sun);
        let [axis, zero] = [axis_lvlh, zero_lvlh].map(|v| normal(Attitude::Lvlh(v), &s));
        for step in -50..=50 {
            let turn = limit_rad * f64::from(step) / 50.0;
            let other = zero * turn.cos() + axis.cross(&zero) * turn.sin();
            assert!(other.dot(&sun) <= best + 1e-12, "{turn} of {limit_rad}");
        }
        let [forward, side, up] =
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]].map(|v| normal(Attitude::Lvlh(v), &s));
        let low = rng.random_range(-PI / 2.0..1.0);
        let high = rng.random_range(low..PI / 2.0);
        let azimuth_limit_rad = rng.random_range(0.0..PI);
        let best = normal(Attitude::SunTwoAxes { azimuth_limit_rad, elevation_rad: [low, high] }, &s).dot(&sun);
        for i in -20..=20 {
            for j in 0..=20 {
                let (sa, ca) = (azimuth_limit_rad * f64::from(i) / 20.0).sin_cos();
                let (se, ce) = (low + (high - low) * f64::from(j) / 20.0).sin_cos();
                let other = (forward * ca + side * sa) * ce + up * se;
                assert!(other.dot(&sun) <= best + 1e-12);
            }
        }
    }
}

#[test]
fn a_gimbal_stops_at_its_limit() {
    // the Sun 80 deg from the zero position, the limit 50: 30 deg are left
    let turn = 80_f64.to_radians();
    for side in [1.0, -1.0] {
        let s = scene(V::new(side * turn.sin(), 0.0, turn.cos()));
        let held = Attitude::SunOneAxis {
            axis_lvlh: [0.0, 1.0, 0.0],
            zero_lvlh: [0.0, 0.0, -1.0],
            limit_rad: 50_f64.to_radians(),
        };
        let off_deg = normal(held, &s).angle_to(&normal(Attitude::Sun, &s)).to_degrees();
        assert!((off_deg - 30.0).abs() < 1e-9, "{off_deg}");
    }
    // a panel that cannot look above 20 deg under a Sun at 70 deg: 50 deg are left
    let s = scene(V::new(0.0, 70_f64.to_radians().cos(), 70_f64.to_radians().sin()));
    let held = Attitude::SunTwoAxes { azimuth_limit_rad: PI, elevation_rad: [0.0, 20_f64.to_radians()] };
    let off_deg = normal(held, &s).angle_to(&normal(Attitude::Sun, &s)).to_degrees();
    assert!((off_deg - 50.0).abs() < 1e-9, "{off_deg}");
}

#[test]
fn a_sun_in_a_singular_direction_leaves_a_finite_documented_normal() {
    let forward = V::new(1.0, 0.0, 0.0);
    for zenith in [1.0, -1.0] {
        let s = scene(V::new(0.0, 0.0, zenith));
        assert!(close(normal(Attitude::SunAzimuth, &s), forward, 1e-12));
        let two = Attitude::SunTwoAxes { azimuth_limit_rad: PI, elevation_rad: [0.0, 0.0] };
        assert!(close(normal(two, &s), forward, 1e-12));
        let along = Attitude::SunOneAxis { axis_lvlh: [0.0, 0.0, 1.0], zero_lvlh: [0.0, 1.0, 0.0], limit_rad: 1.0 };
        assert!(close(normal(along, &s), V::new(0.0, -1.0, 0.0), 1e-12));
    }
    assert!(close(normal(Attitude::SunToNadir, &scene(V::new(0.0, 0.0, 1.0))), forward, 1e-12));
    assert!(close(normal(Attitude::SunToNadir, &scene(V::new(0.0, 0.0, -1.0))), V::new(0.0, 0.0, -1.0), 1e-12));
}

#[test]
fn what_has_no_direction_is_none_and_never_nan() {
    let s = scene(V::new(0.0, 1.0, 0.0));
    let radial = Scene { velocity_km_s: V::new(0.0, 0.0, 7.6), ..s };
    let resting = Scene { velocity_km_s: V::new(0.0, 0.0, 0.0), ..s };
    for s in [radial, resting] {
        assert!(Attitude::Lvlh([1.0, 0.0, 0.0]).normal(&s).is_none());
        assert!(Attitude::Sun.normal(&s).is_some() && Attitude::SunAzimuth.normal(&s).is_some());
    }
    assert!(Attitude::Fixed(V::new(0.0, 0.0, 0.0)).normal(&s).is_none());
    assert!(Attitude::Lvlh([f64::NAN, 0.0, 0.0]).normal(&s).is_none());
    assert!(Attitude::Inertial { ra_rad: f64::INFINITY, dec_rad: 0.0 }.normal(&s).is_none());
}

#[test]
fn a_mirror_between_sun_and_nadir_sends_sunlight_straight_down() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    for _ in 0..100 {
        let s = anywhere(&mut rng);
        let (n, sun) = (normal(Attitude::SunToNadir, &s), normal(Attitude::Sun, &s));
        let sent = n * (2.0 * n.dot(&sun)) - sun;
        assert!(close(sent, normal(Attitude::Nadir, &s), 1e-12));
    }
}

#[test]
fn panels_keep_tracking_the_geometric_sun_in_the_earths_shadow() {
    // the Sun behind the Earth: the panel's front looks at the ground
    let s = scene(V::new(0.01, 0.0, -1.0));
    for attitude in [
        Attitude::Sun,
        Attitude::SunTwoAxes { azimuth_limit_rad: PI, elevation_rad: [-PI / 2.0, PI / 2.0] },
        Attitude::SunOneAxis { axis_lvlh: [0.0, 1.0, 0.0], zero_lvlh: [0.0, 0.0, -1.0], limit_rad: PI },
    ] {
        let toward = (s.sun_km - s.satellite_km).unit().unwrap();
        assert!(normal(attitude, &s).angle_to(&toward) < 1e-9, "{attitude:?}");
        assert!(normal(attitude, &s).dot(&normal(Attitude::Nadir, &s)) > 0.99);
    }
}

#[test]
fn a_choice_for_all_arrays_moves_only_what_tracks_the_sun() {
    let surface = |attitude| Surface {
        name: "plate".into(),
        area_m2: 1.0,
        attitude,
        brdf: Brdf::Lambert { albedo: 0.5 },
        back: Some(Brdf::Lambert { albedo: 0.1 }),
    };
    for attitude in held_by_the_orbit() {
        let tracks = matches!(
            attitude,
            Attitude::Sun | Attitude::SunAzimuth | Attitude::SunOneAxis { .. } | Attitude::SunTwoAxes { .. }
        );
        for (choice, held) in [(config::Arrays::Sun, Attitude::Sun), (config::Arrays::SunAzimuth, Attitude::SunAzimuth)]
        {
            let expected = if tracks { held } else { attitude };
            assert_eq!(surface(attitude).with_arrays(choice).attitude, expected);
        }
        assert_eq!(surface(attitude).with_arrays(config::Arrays::AsListed), surface(attitude));
    }
    assert_eq!(surface(Attitude::Nadir).with_backs(config::Backs::Black).back, None);
    assert!(surface(Attitude::Nadir).with_backs(config::Backs::AsListed).back.is_some());
}

#[test]
fn attitudes_that_mean_nothing_are_refused_by_name() {
    let check = |attitude: Attitude| attitude.check("array").unwrap_err().to_string();
    let (y, up) = ([0.0, 1.0, 0.0], [0.0, 0.0, -1.0]);
    for bad in [
        Attitude::Lvlh([0.0; 3]),
        Attitude::Lvlh([f64::NAN, 1.0, 0.0]),
        Attitude::Inertial { ra_rad: f64::NAN, dec_rad: 0.0 },
        Attitude::Inertial { ra_rad: 0.0, dec_rad: 2.0 },
        Attitude::SunOneAxis { axis_lvlh: [0.0; 3], zero_lvlh: up, limit_rad: 1.0 },
        Attitude::SunOneAxis { axis_lvlh: y, zero_lvlh: [0.0, -2.0, 0.0], limit_rad: 1.0 },
        Attitude::SunOneAxis { axis_lvlh: y, zero_lvlh: up, limit_rad: -1.0 },
        Attitude::SunOneAxis { axis_lvlh: y, zero_lvlh: up, limit_rad: f64::NAN },
        Attitude::SunTwoAxes { azimuth_limit_rad: 4.0, elevation_rad: [0.0, 1.0] },
        Attitude::SunTwoAxes { azimuth_limit_rad: 1.0, elevation_rad: [1.0, 0.0] },
        Attitude::Fixed(V::new(0.0, 0.0, 0.0)),
    ] {
        assert!(check(bad).contains("array"), "{bad:?}");
        // and whoever skips the check gets no panic
        let _ = bad.normal(&scene(V::new(0.3, 0.4, 0.1)));
    }
    held_by_the_orbit().into_iter().for_each(|good| good.check("array").unwrap());
}
