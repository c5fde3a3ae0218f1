//! What `satphot fetch` may ask a service, and what it accepts: against a server on the loopback, at moments of our choosing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::fetch_support;

use std::path::Path;
use std::time::Duration;

use fetch_support::client::{current, iss, session, settings, utc, with_client};
use fetch_support::{HTML, NEAREST_NONE, NEAREST_TLE, NOT_UPDATED, Reply, STARS, Server, apass, iss_omm, nearest_omm};
use satphot::Error;
use satphot::config::Fetch;
use satphot::fetch::{Cache, Field, Object, Wanted, celestrak_query, fetch_elements, fetch_stars};

const EPOCH: &str = "2026-07-08T17:37:14.092032";

const NOW: &str = "2026-07-09T06:00:00";
const LINE2: &str = "2 25544  51.6414 284.5574 0002475 176.3471 287.7672 15.49357173436989\n";

#[test]
fn a_query_is_sent_once_within_the_update_period_and_again_after_it() {
    let (server, cache) = (Server::always(Reply::ok(iss_omm(EPOCH))), tempfile::tempdir().unwrap());
    for (now, n_queries) in [
        (NOW, 1),
        ("2026-07-09T06:00:30", 1),
        ("2026-07-09T07:59:00", 1),
        ("2026-07-09T08:00:01", 2),
        ("2026-07-09T09:00:00", 2),
    ] {
        let got = current(&server, cache.path(), now).outcome.unwrap();
        assert_eq!((got.elements.norad_cat_id(), got.text.as_str()), (25544, iss_omm(EPOCH).as_str()));
        assert_eq!(server.count(), n_queries, "{now}");
    }
    let request = &server.requests()[0];
    assert_eq!(request.path, "/gp.php?CATNR=25544&FORMAT=JSON");
    assert_eq!(request.agent, format!("satphot/{}", env!("CARGO_PKG_VERSION")));
    let known = Fetch { contact: Some("observer@example.org".into()), ..settings(&server) };
    session(&known, tempfile::tempdir().unwrap().path(), NOW, &iss(NOW));
    assert!(server.requests()[2].agent.ends_with(" (+observer@example.org)"));
}

#[test]
fn a_clock_that_was_set_back_does_not_make_an_answer_live_for_ever() {
    let (server, cache) = (Server::always(Reply::ok(iss_omm(EPOCH))), tempfile::tempdir().unwrap());
    current(&server, cache.path(), NOW).outcome.unwrap();
    current(&server, cache.path(), "2026-07-08T18:00:00").outcome.unwrap();
    assert_eq!(server.count(), 2);
}

#[test]
fn an_object_the_service_does_not_have_is_requested_once() {
    for reply in [Reply::status("404 Not Found", "No GP data found"), Reply::ok("No GP data found"), Reply::ok("[]")] {
        let (server, cache) = (Server::always(reply), tempfile::tempdir().unwrap());
        for _ in 0..2 {
            let s = current(&server, cache.path(), NOW);
            assert_eq!(s.error().exit_code(), 5, "{}", s.error());
            s.says(&["no elements of object 25544", "CelesTrak has none"]);
        }
        assert_eq!(server.count(), 1);
        current(&server, cache.path(), "2026-07-09T08:00:01");
        assert_eq!(server.count(), 2);
    }
}

#[test]
fn a_refusal_is_not_repeated_and_the_whole_service_is_left_alone() {
    let (server, cache) = (Server::always(Reply::status("403 Forbidden", HTML)), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert_eq!((s.error().exit_code(), s.waits_s.len(), server.count()), (75, 0, 1));
    s.says(&["CelesTrak refuses: HTTP 403, a page in HTML (502 Bad Gateway)", "until 2026-07-09T08:00:00Z"]);
    // another object, another call
    let other = Wanted { object: Object::Number(20580), ..iss(NOW) };
    let s = session(&settings(&server), cache.path(), "2026-07-09T07:59:59", &other);
    assert_eq!((s.error().exit_code(), server.count()), (75, 1));
    session(&settings(&server), cache.path(), "2026-07-09T08:00:01", &other);
    assert_eq!(server.count(), 2);
}

#[test]
fn too_many_requests_wait_as_long_as_the_server_asks() {
    let busy = Reply::status("429 Too Many Requests", "slow down");
    for (line, until, later) in [
        ("Retry-After: 600", "until 2026-07-09T06:10:00Z", "2026-07-09T06:10:01"),
        ("Retry-After: Thu, 09 Jul 2026 06:20:00 GMT", "until 2026-07-09T06:20:00Z", "2026-07-09T06:20:01"),
        ("Retry-After: 99999999", "until 2026-07-10T06:00:00Z", "2026-07-10T06:00:01"), // a day at most
        ("X-Nothing: said", "until 2026-07-09T08:00:00Z", "2026-07-09T08:00:01"),
    ] {
        let (server, cache) = (Server::always(busy.clone().header(line)), tempfile::tempdir().unwrap());
        let s = current(&server, cache.path(), NOW);
        assert_eq!((s.error().exit_code(), server.count()), (75, 1), "a 4xx is never repeated");
        s.says(&["HTTP 429, \"slow down\"", until]);
        current(&server, cache.path(), NOW);
        assert_eq!(server.count(), 1, "{line}");
        current(&server, cache.path(), later);
        assert_eq!(server.count(), 2, "{line}");
    }
}

#[test]
fn a_server_in_trouble_is_queried_again_with_growing_pauses_and_not_for_ever() {
    let good_at_last = |n_bad: usize| {
        Server::new(move |_, n| if n < n_bad { Reply::status("500 Oops", "") } else { Reply::ok(iss_omm(EPOCH)) })
    };
    let (server, cache) = (good_at_last(2), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert!(s.outcome.is_ok());
    assert_eq!((s.waits_s, server.count()), (vec![3.0, 6.0], 3));

    let (server, cache) = (good_at_last(3), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert_eq!((s.error().exit_code(), server.count()), (75, 3));
    s.says(&["HTTP 500 of the server (3 tries)", "fetch.celestrak_url", "try again later"]);
}

#[test]
fn retry_after_of_a_server_in_trouble_is_waited_for_within_a_bound() {
    let busy = |line: &'static str| {
        Server::new(
            move |_, n| {
                if n == 0 { Reply::status("503 Busy", "").header(line) } else { Reply::ok(iss_omm(EPOCH)) }
            },
        )
    };
    let (server, cache) = (busy("Retry-After: 45"), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert_eq!((s.outcome.is_ok(), s.waits_s, server.count()), (true, vec![45.0], 2));
    // fetch.max_wait_s = 60: not waited for, but remembered
    let (server, cache) = (busy("Retry-After: 3600"), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert_eq!((s.error().exit_code(), s.waits_s.len(), server.count()), (75, 0, 1));
    s.says(&["until 2026-07-09T07:00:00Z"]);
    current(&server, cache.path(), "2026-07-09T06:59:00");
    assert_eq!(server.count(), 1);
}

#[test]
fn what_is_not_elements_never_enters_the_cache_and_is_named() {
    let tle = "ISS (ZARYA)\n1 25544U 98067A   24030.10147156  .00014904  00000-0  27473-3 0  9998\n";
    let damaged = iss_omm(EPOCH).replace("51.6304", "951.6304");
    for (body, said) in [
        (HTML.as_bytes().to_vec(), "a page in HTML (502 Bad Gateway)"),
        (Vec::new(), "an empty answer"),
        (b"\x00\x01\xfe\xff\x00rubbish".to_vec(), "not text"),
        (b"\x89PNG\r\n\x1a\n\x00\x00".to_vec(), "not text"),
        (iss_omm(EPOCH).as_bytes()[..200].to_vec(), "not valid JSON"),
        (b"{\"error\": \"database is down\"}".to_vec(), "database is down"),
        (damaged.into_bytes(), "inclination 951.6304"),
        (iss_omm(EPOCH).replace("25544", "20580").into_bytes(), "not of object 25544"),
        (tle.as_bytes().to_vec(), "not elements"),
        (format!("{}{LINE2}", tle.replace("9998", "9997")).into_bytes(), "checksum"),
    ] {
        let (server, cache) = (Server::always(Reply::ok(body.clone())), tempfile::tempdir().unwrap());
        let s = current(&server, cache.path(), NOW);
        assert_eq!((s.error().exit_code(), server.count()), (75, 1), "{}", s.error());
        s.says(&["CelesTrak", said]);
        let kept: Vec<_> = std::fs::read_dir(cache.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert!(kept.iter().all(|n| n.to_string_lossy().ends_with(".lock")), "{kept:?}");
    }
}

#[test]
fn an_answer_cut_in_the_middle_is_repeated_and_then_refused() {
    let (server, cache) = (Server::always(Reply::ok(iss_omm(EPOCH)).cut()), tempfile::tempdir().unwrap());
    let s = current(&server, cache.path(), NOW);
    assert_eq!((s.error().exit_code(), server.count()), (75, 3));
    s.says(&["ended in the middle of the answer (3 tries)"]);
}

#[test]
fn a_slow_server_and_one_that_speaks_no_http_are_given_up() {
    let slow = Reply::ok(iss_omm(EPOCH)).after(Duration::from_secs(3));
    for (reply, said) in
        [(slow, "no answer within fetch.timeout_s = 0.3 s"), (Reply::raw(b"SSH-2.0-OpenSSH\r\n\r\n"), "not HTTP")]
    {
        let (server, cache) = (Server::always(reply), tempfile::tempdir().unwrap());
        let hasty = Fetch { timeout_s: 0.3, retries: 1, ..settings(&server) };
        let s = session(&hasty, cache.path(), NOW, &iss(NOW));
        assert_eq!((s.error().exit_code(), s.waits_s.len(), server.count()), (75, 1, 2), "{}", s.error());
        s.says(&[said, "(2 tries)"]);
    }
}

#[test]
fn nobody_listening_is_an_error_for_another_try() {
    let cache = tempfile::tempdir().unwrap();
    // a port that was free a moment ago
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let nowhere = Fetch { celestrak_url: format!("http://127.0.0.1:{port}/gp.php"), ..Fetch::default() };
    let s = session(&nowhere, cache.path(), NOW, &iss(NOW));
    assert_eq!((s.error().exit_code(), s.waits_s.len()), (75, 2));
    s.says(&["no connection"]);
}

#[test]
fn a_huge_answer_is_not_taken() {
    let (server, cache) = (Server::always(Reply::ok(vec![b' '; 300_000])), tempfile::tempdir().unwrap());
    let small = Fetch { max_mb: 0.1, ..settings(&server) };
    let s = session(&small, cache.path(), NOW, &iss(NOW));
    assert_eq!((s.error().exit_code(), server.count()), (75, 1));
    s.says(&["larger than fetch.max_mb = 0.1 MB"]);
}

#[test]
fn redirections_are_followed_but_not_in_circles() {
    let server = Server::new(|r, _| match r.path.starts_with("/gp.php") {
        true => Reply::status("301 Moved Permanently", "").header("Location: /new/gp?x=1"),
        false => Reply::ok(iss_omm(EPOCH)),
    });
    let cache = tempfile::tempdir().unwrap();
    assert!(current(&server, cache.path(), NOW).outcome.is_ok());
    assert_eq!(server.count(), 2);
    let circle = Server::always(Reply::status("302 Found", "").header("Location: /gp.php"));
    let s = current(&circle, tempfile::tempdir().unwrap().path(), NOW);
    assert_eq!(s.error().exit_code(), 75);
    s.says(&["redirections"]);
    assert!(circle.count() <= 6, "{}", circle.count());
}

#[test]
fn nothing_newer_means_that_the_cached_answer_is_current() {
    for reply in [Reply::status("403 Forbidden", NOT_UPDATED), Reply::ok(NOT_UPDATED)] {
        let server = Server::new(move |_, n| if n == 0 { Reply::ok(iss_omm(EPOCH)) } else { reply.clone() });
        let cache = tempfile::tempdir().unwrap();
        current(&server, cache.path(), NOW).outcome.unwrap();
        let s = current(&server, cache.path(), "2026-07-09T09:00:00");
        assert_eq!(s.outcome.as_ref().unwrap().text, iss_omm(EPOCH));
        s.says(&["nothing newer than the answer of 2026-07-09T06:00:00Z"]);
        // and is then left alone for another period
        current(&server, cache.path(), "2026-07-09T10:30:00").outcome.unwrap();
        assert_eq!(server.count(), 2);
        // without a cached answer there is nothing to use
        let s = current(&server, tempfile::tempdir().unwrap().path(), NOW);
        assert_eq!(s.error().exit_code(), 75);
        s.says(&["has not updated since your last", "try again"]);
    }
}

#[test]
fn a_damaged_cache_is_fetched_again_and_never_used() {
    type Damage = fn(&Path, &Path);
    let damages: [(&str, Damage); 6] = [
        ("a byte of the answer", |answer, _| {
            let mut bytes = std::fs::read(answer).unwrap();
            bytes[120] ^= 1;
            std::fs::write(answer, bytes).unwrap();
        }),
        ("half of the answer", |answer, _| std::fs::write(answer, &iss_omm(EPOCH)[..100]).unwrap()),
        ("no answer", |answer, _| std::fs::remove_file(answer).unwrap()),
        ("no note", |_, note| std::fs::remove_file(note).unwrap()),
        ("half of the note", |_, note| std::fs::write(note, "{\"url\": \"http").unwrap()),
        ("the note of another question", |_, note| {
            let text = std::fs::read_to_string(note).unwrap().replace("25544", "20580");
            std::fs::write(note, text).unwrap();
        }),
    ];
    for (what, damage) in damages {
        let (server, folder) = (Server::always(Reply::ok(iss_omm(EPOCH))), tempfile::tempdir().unwrap());
        current(&server, folder.path(), NOW).outcome.unwrap();
        let query = celestrak_query(&settings(&server), &Object::Number(25544), false);
        let (answer, note) = Cache::new(folder.path()).paths(&query);
        damage(&answer, &note);
        let s = current(&server, folder.path(), NOW);
        assert_eq!(s.outcome.as_ref().unwrap().text, iss_omm(EPOCH), "{what}");
        s.says(&["the cache is damaged"]);
        assert_eq!(server.count(), 2, "{what}");
        current(&server, folder.path(), NOW).outcome.unwrap();
        assert_eq!(server.count(), 2, "{what}: mended");
    }
}

#[test]
fn offline_uses_the_cache_whatever_its_age_and_nothing_else() {
    let (server, cache) = (Server::always(Reply::ok(iss_omm(EPOCH))), tempfile::tempdir().unwrap());
    current(&server, cache.path(), NOW).outcome.unwrap();
    let s = settings(&server);
    let later = "2026-07-12T06:00:00";
    let (got, said, _) = with_client(&s, cache.path(), later, true, |client| fetch_elements(client, &iss(later), &s));
    assert_eq!(got.unwrap().text, iss_omm(EPOCH));
    assert!(said.iter().any(|t| t.contains("of 2026-07-09T06:00:00Z from the cache")), "{said:?}");
    let empty = tempfile::tempdir().unwrap();
    let (got, ..) = with_client(&s, empty.path(), NOW, true, |client| fetch_elements(client, &iss(NOW), &s));
    let error = got.unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert!(error.to_string().contains("`offline`"), "{error}");
    assert_eq!(server.count(), 1);
}

#[test]
fn a_night_of_the_past_is_requested_from_satchecker_with_its_julian_date() {
    let (server, cache) = (Server::always(Reply::ok(NEAREST_TLE)), tempfile::tempdir().unwrap());
    let night = "2024-01-30T12:00:00"; // JD 2460340.0
    let got = session(&settings(&server), cache.path(), NOW, &iss(night)).outcome.unwrap();
    assert_eq!(server.requests()[0].path, "/tools/get-nearest-tle/?id=25544&id_type=catalog&epoch=2460340.00");
    // 2024 day 30.10147156; the file is the three lines and reads as them
    assert!((got.elements.age_d(&utc("2024-01-30T00:00:00")) + 0.10147156).abs() < 1e-6);
    assert_eq!((got.elements.name(), got.text.lines().count()), ("ISS (ZARYA)", 3));
    session(&settings(&server), cache.path(), "2026-07-10T05:00:00", &iss(night)).outcome.unwrap();
    assert_eq!(server.count(), 1, "an archive is asked once a day at most");
}

#[test]
fn an_archive_that_answers_with_its_last_set_sends_us_to_the_other_one() {
    let server = Server::new(|r, _| {
        if r.path.contains("get-nearest-tle") { Reply::ok(NEAREST_TLE) } else { Reply::ok(nearest_omm(EPOCH)) }
    });
    let cache = tempfile::tempdir().unwrap();
    // before the handover of 2026-07-12: TLE first, whose nearest is two years off
    let got =
        session(&settings(&server), cache.path(), "2026-09-01T00:00:00", &iss("2026-07-09T00:00:00")).outcome.unwrap();
    assert_eq!((got.elements.format(), server.count()), ("OMM JSON", 2));
    // far from both: none, and both distances are reported
    let s = session(&settings(&server), cache.path(), "2026-09-01T00:00:00", &iss("2025-01-01T00:00:00"));
    assert_eq!(s.error().exit_code(), 5);
    s.says(&["within 14 d", "336.9 d before", "553.7 d after", "`max_age_d`"]);
}

#[test]
fn satchecker_without_the_object_is_nothing_found_and_errors_stop_before_the_other_archive() {
    let (server, cache) = (Server::always(Reply::ok(NEAREST_NONE)), tempfile::tempdir().unwrap());
    let s = session(&settings(&server), cache.path(), NOW, &iss("2024-01-30T12:00:00"));
    assert_eq!((s.error().exit_code(), server.count()), (5, 2));
    let (server, cache) =
        (Server::always(Reply::status("400 Bad Request", "Missing parameter")), tempfile::tempdir().unwrap());
    let s = session(&settings(&server), cache.path(), NOW, &iss("2024-01-30T12:00:00"));
    assert_eq!((s.error().exit_code(), server.count()), (75, 1));
    s.says(&["HTTP 400, \"Missing parameter\""]);
}

#[test]
fn a_name_must_mean_one_object() {
    let iss = iss_omm(EPOCH);
    let other = iss.replace("ISS (ZARYA)", "ISS DEB").replace("25544", "60001");
    let both = format!("[{},{}]", iss.trim_matches(['[', ']']), other.trim_matches(['[', ']']));
    let (server, cache) = (Server::always(Reply::ok(both)), tempfile::tempdir().unwrap());
    let named = |name: &str| Wanted { object: Object::Name(name.into()), ..fetch_support::client::iss(NOW) };
    let got = session(&settings(&server), cache.path(), NOW, &named("iss (zarya)")).outcome.unwrap();
    assert_eq!(got.elements.norad_cat_id(), 25544);
    let sets = satphot::orbit::elements_from_bytes(got.text.into_bytes(), Path::new("x")).unwrap();
    assert_eq!(sets.len(), 1, "the file holds the one object");
    let s = session(&settings(&server), cache.path(), NOW, &named("IS"));
    assert_eq!(s.error().exit_code(), 2);
    s.says(&["ISS (ZARYA) [25544], ISS DEB [60001]", "`norad`"]);
}

fn stars(server: &Server, cache: &Path, fields: &[Field]) -> Result<satphot::fetch::FetchedStars, Error> {
    let s = settings(server);
    with_client(&s, cache, NOW, false, |client| fetch_stars(client, fields, &s)).0
}

#[test]
fn stars_of_overlapping_fields_are_one_catalogue_that_satphot_reads() {
    let server = Server::new(|_, n| Reply::ok(apass(if n == 0 { &STARS[..2] } else { &STARS[1..] })));
    let cache = tempfile::tempdir().unwrap();
    let fields = [Field::new(0.35, -0.9, 0.3, "a"), Field::new(0.42, -0.85, 0.3, "b")];
    let got = stars(&server, cache.path(), &fields).unwrap();
    assert_eq!((got.n, got.n_repeated, got.n_without_v), (3, 1, 1));
    let path = cache.path().join("apass.csv");
    std::fs::write(&path, &got.text).unwrap();
    let read = satphot::astrometry::catalogue::Catalogue::read(&path, &Default::default()).unwrap();
    assert_eq!((read.stars.len(), read.n_skipped), (3, 0));
    let s = &read.stars[0];
    assert_eq!((s.id.as_str(), s.ra_deg, s.dec_deg, s.v_mag), ("16572870", 0.345154, -0.907018, 13.399));
    assert_eq!((s.v_err_mag, s.b_v_mag, s.b_v_err_mag), (Some(0.075), Some(1.418), Some(0.09)));
    // a finished release is never asked for again
    stars(&server, cache.path(), &fields).unwrap();
    assert_eq!(server.count(), 2);
}

#[test]
fn fields_are_not_requested_after_one_has_failed() {
    let server = Server::new(|_, n| if n == 1 { Reply::ok(HTML) } else { Reply::ok(apass(&STARS)) });
    let cache = tempfile::tempdir().unwrap();
    let fields: Vec<Field> = (0..5).map(|i| Field::new(10.0 * f64::from(i), 0.0, 0.3, "f")).collect();
    assert_eq!(stars(&server, cache.path(), &fields).unwrap_err().exit_code(), 75);
    assert_eq!(server.count(), 2);
    // what came is kept: the next call goes on where this one stopped
    stars(&server, cache.path(), &fields).unwrap();
    assert_eq!(server.count(), 2 + 4);
}

#[test]
fn a_table_of_stars_that_was_cut_or_is_none_is_refused() {
    let whole = apass(&STARS);
    let cut = whole[..whole.len() - 60].to_owned(); // in a row, with a Content-Length that agrees
    for (body, said) in
        [(cut, "cut"), (HTML.to_owned(), "HTML"), ("recno,RAJ2000\n1,2\n".to_owned(), "not a table of stars")]
    {
        let (server, cache) = (Server::always(Reply::ok(body)), tempfile::tempdir().unwrap());
        let error = stars(&server, cache.path(), &[Field::new(0.4, -0.9, 0.3, "f")]).unwrap_err();
        assert_eq!(error.exit_code(), 75);
        assert!(error.to_string().contains(said), "{error}");
    }
    let (server, cache) = (Server::always(Reply::ok(apass(&[]))), tempfile::tempdir().unwrap());
    let error = stars(&server, cache.path(), &[Field::new(0.4, -0.9, 0.3, "f")]).unwrap_err();
    assert_eq!(error.exit_code(), 5);
    assert!(error.to_string().contains("no star"), "{error}");
}
