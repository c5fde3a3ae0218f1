//! `satphot fetch` as an observer runs it: files, exit codes, messages; against a server on the loopback.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use crate::fetch_support;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use fetch_support::{HTML, NEAREST_TLE, Reply, STARS, Server, apass, iss_omm};
use satphot::base::time::{iso_utc, shifted};
use satphot::config::ELEMENTS;

/// A folder to work in, with a cache of its own and no proxies.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
    fn command(&self, server: &Server, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_satphot"));
        command.current_dir(self.folder.path()).arg("fetch").args(args).env("XDG_CACHE_HOME", self.path("xdg"));
        command.args(["--celestrak-url", &server.url("gp.php"), "--satchecker-url", &server.url("tools")]);
        command.args(["--vizier-url", &server.url("viz-bin/asu-tsv")]);
        for variable in ["ALL_PROXY", "HTTPS_PROXY", "HTTP_PROXY", "NO_PROXY"] {
            command.env_remove(variable).env_remove(variable.to_lowercase());
        }
        command
    }
    fn fetch(&self, server: &Server, args: &[&str]) -> Said {
        Said::of(self.command(server, args).output().unwrap())
    }
    /// A night of four small frames: two flats, one star pointing at RA 0.4, one target frame of 2024-01-30.
    fn night(&self) -> &Self {
        let toml = "preset = \"macquarie-cdk24\"\n[night]\nname = \"2024-01-30\"\ninput = [\"raw\"]\noutput = \"out\"\n\
                    [frames]\ntarget_objects = [\"ISS\"]\n[stars]\ncatalogue = \"apass.csv\"\nbv_range_mag = [0.2, 0.9]\n\
                    v_range_mag = [10.0, 15.0]\n[orbit]\nelements = \"elements.tle\"\nnorad_cat_id = 25544\n";
        std::fs::write(self.path("pipeline.toml"), toml).unwrap();
        std::fs::create_dir_all(self.path("raw")).unwrap();
        let pointing = "OBJCTRA = '00 01 36'\nOBJCTDEC= '-00 54 00'\n";
        self.frame("field.fits", &format!("OBJECT  = 'SA 92'\n{pointing}"));
        self.frame("iss.fits", "OBJECT  = 'ISS'\nOBJCTRA = '10 00 00'\nOBJCTDEC= '-30 00 00'\n");
        self
    }
    fn frame(&self, name: &str, more: &str) {
        let cards = format!(
            "SIMPLE  = T\nBITPIX  = 16\nNAXIS   = 2\nNAXIS1  = 10\nNAXIS2  = 8\nBZERO   = 32768\nIMAGETYP= 'LIGHT'\n\
             EXPTIME = 3.0\nGAIN    = 200\nDATE-OBS= '2024-01-30T10:00:00.000'\n{more}END\n"
        );
        let mut bytes: Vec<u8> = cards.lines().flat_map(|l| format!("{l:<80}").into_bytes()).collect();
        bytes.resize(2880, b' ');
        bytes.resize(2880 * 2, 0);
        std::fs::write(self.path("raw").join(name), bytes).unwrap();
    }
}

/// What a call left.
struct Said {
    code: i32,
    out: String,
    err: String,
}

impl Said {
    fn of(output: Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { code: output.status.code().unwrap(), out: text(&output.stdout), err: text(&output.stderr) }
    }
    fn expect(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, code, "{}{}", self.out, self.err);
        assert!(words.iter().all(|w| self.err.contains(w)), "{words:?} not in:\n{}", self.err);
        self
    }
}

/// The ISS of half a day ago: what CelesTrak would give today.
fn iss_of_today() -> String {
    let now = hifitime::Epoch::from_unix_seconds(
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_secs_f64(),
    );
    iss_omm(iso_utc(shifted(now, -43_200.0), 6).trim_end_matches('Z'))
}

/// The ISS of 2024-01-30 as CelesTrak's FORMAT=TLE would have written it.
const TLE: &str = "ISS (ZARYA)             \r\n1 25544U 98067A   24030.10147156  .00014904  00000-0  27473-3 0  9998\r\n\
                   2 25544  51.6414 284.5574 0002475 176.3471 287.7672 15.49357173436989\r\n";

/// CelesTrak, SatChecker and VizieR at one address.
fn services() -> Server {
    Server::new(|r, _| match r.path.as_str() {
        p if p.starts_with("/gp.php") && p.contains("CATNR=25544&FORMAT=JSON") => Reply::ok(iss_of_today()),
        p if p.starts_with("/gp.php") && p.contains("CATNR=25544&FORMAT=TLE") => Reply::ok(TLE),
        p if p.starts_with("/gp.php") => Reply::status("404 Not Found", "No GP data found"),
        p if p.starts_with("/tools/get-nearest-tle/") => Reply::ok(NEAREST_TLE),
        p if p.starts_with("/viz-bin/asu-tsv?-source=II/336/apass9&") => Reply::ok(apass(&STARS)),
        _ => Reply::status("404 Not Found", HTML),
    })
}

#[test]
fn current_elements_go_to_a_file_once_and_the_path_alone_to_standard_output() {
    let (server, place) = (services(), Place::new());
    let args = ["elements", "--norad", "25544", "-o", "iss.json"];
    let said = place
        .fetch(&server, &args)
        .expect(0, &["requesting CelesTrak", "wrote iss.json: ISS (ZARYA) [25544]", "0.5 d before"]);
    assert_eq!(said.out, "iss.json\n");
    let sets = satphot::orbit::read_elements(&place.path("iss.json")).unwrap();
    assert_eq!((sets.len(), sets[0].norad_cat_id()), (1, 25544));
    // there already; then with --force, from the cache
    place.fetch(&server, &args).expect(2, &["iss.json exists already", "--force"]);
    place.fetch(&server, &[&args[..], &["--force"]].concat()).expect(0, &["from the cache"]);
    assert_eq!(server.count(), 1);
    assert!(place.path("xdg/satphot").is_dir());
    let quiet = place.fetch(&server, &[&args[..], &["--force", "-q"]].concat()).expect(0, &[]);
    assert_eq!((quiet.out.as_str(), quiet.err.as_str()), ("iss.json\n", ""));
}

#[test]
fn a_file_that_is_there_is_left_as_it_is_and_no_service_is_queried() {
    let (server, place) = (services(), Place::new());
    std::fs::write(place.path("mine.tle"), "mine").unwrap();
    place.fetch(&server, &["elements", "--norad", "25544", "-o", "mine.tle"]).expect(2, &["exists already"]);
    place
        .fetch(&server, &["stars", "--ra-deg", "0.4", "--dec-deg", "-0.9", "-o", "mine.tle"])
        .expect(2, &["exists already"]);
    place.fetch(&server, &["elements", "--norad", "1", "-o", "."]).expect(2, &["is a folder"]);
    place.fetch(&server, &["elements", "--norad", "1", "-o", "no/such.tle"]).expect(4, &["no such folder"]);
    // nor is it when the server has nothing to give, with --force
    place
        .fetch(&server, &["elements", "--norad", "99", "-o", "mine.tle", "--force"])
        .expect(5, &["no elements of object 99"]);
    assert_eq!(std::fs::read_to_string(place.path("mine.tle")).unwrap(), "mine");
    assert_eq!(server.count(), 1);
}

#[test]
fn a_file_called_tle_is_requested_as_tle_unless_the_number_has_none() {
    let (server, place) = (services(), Place::new());
    let old = ["--source", "celestrak", "--date", "2024-01-30"];
    let args = ["elements", "--norad", "25544", "-o", "iss.tle"];
    place.fetch(&server, &[&args[..], &old[..]].concat()).expect(0, &["3LE"]);
    assert_eq!(std::fs::read_to_string(place.path("iss.tle")).unwrap(), TLE);
    let new = place.fetch(&server, &["elements", "--norad", "100001", "-o", "new.tle", "--dry-run"]).expect(0, &[]);
    assert!(new.out.ends_with("CATNR=100001&FORMAT=JSON\n"), "{}", new.out);
    let json = ["--format", "json", "--dry-run"];
    let output =
        place.fetch(&server, &[&["elements", "--norad", "25544", "-o", "b.tle"], &json[..]].concat()).expect(0, &[]);
    assert!(output.out.ends_with("CATNR=25544&FORMAT=JSON\n"), "{}", output.out);
}

#[test]
fn a_bare_fetch_gets_what_the_configuration_names_and_does_not_have() {
    let (server, place) = (services(), Place::new());
    place.night();
    let dry = place.fetch(&server, &["--dry-run"]).expect(0, &[]);
    let urls: Vec<&str> = dry.out.lines().collect();
    assert_eq!(urls.len(), 3, "{}", dry.out);
    assert!(urls[0].contains("/tools/get-nearest-tle/?id=25544&id_type=catalog&epoch=2460339.92"), "{}", urls[0]);
    assert!(urls[2].contains("-c=0.4000%20-0.9000&"), "{}", urls[2]);
    assert_eq!(server.count(), 0);
    assert!(!place.path("apass.csv").exists() && !place.path("elements.tle").exists());

    let said =
        place.fetch(&server, &["-c", "pipeline.toml"]).expect(0, &["the night's frames", "3 stars of APASS DR9"]);
    assert_eq!(said.out, "elements.tle\napass.csv\n");
    assert_eq!(satphot::orbit::read_elements(&place.path("elements.tle")).unwrap()[0].format(), "3LE");
    assert_eq!(server.count(), 2, "the field of the target frame is not asked for");

    let again =
        place.fetch(&server, &[]).expect(0, &["elements.tle is there and stays", "apass.csv is there and stays"]);
    assert_eq!((again.out.as_str(), server.count()), ("", 2));
    std::fs::remove_file(place.path("elements.tle")).unwrap();
    let one = place.fetch(&server, &[]).expect(0, &["from the cache"]);
    assert_eq!((one.out.as_str(), server.count()), ("elements.tle\n", 2));
}

#[test]
fn the_stars_of_the_passes_are_fetched_where_star_trails_are_measured() {
    let (server, place) = (services(), Place::new());
    place.night();
    let toml = std::fs::read_to_string(place.path("pipeline.toml")).unwrap();
    std::fs::write(place.path("pipeline.toml"), format!("{toml}[zeropoint]\nstar_trails = true\n")).unwrap();
    std::fs::write(place.path("elements.tle"), TLE).unwrap();
    let stars = ["stars", "-c", "pipeline.toml", "--dry-run"];
    let two = place.fetch(&server, &stars).expect(0, &[]);
    let urls: Vec<&str> = two.out.lines().collect();
    assert_eq!(urls.len(), 2, "{}", two.out);
    // by the elements, wherever the header says that the frame points
    assert!(!urls[0].contains("-c=150.0000"), "{}", two.out);
    // without elements, those of the star pointing alone, and a word about it
    std::fs::remove_file(place.path("elements.tle")).unwrap();
    let one = place.fetch(&server, &stars).expect(0, &["without the stars of the passes"]);
    assert_eq!(one.out.lines().count(), 1, "{}", one.out);
}

#[test]
fn elements_that_are_there_but_of_another_time_are_reported() {
    let (server, place) = (services(), Place::new());
    place.night();
    std::fs::write(place.path("elements.tle"), ELEMENTS[0].1).unwrap();
    place
        .fetch(&server, &[])
        .expect(0, &["elements.tle is there and stays", "d from 2024-01-30T10:00:0", "orbit.max_age_d = 14 d"]);
}

#[test]
fn what_is_missing_in_a_question_is_requested_before_the_network() {
    let (server, place) = (services(), Place::new());
    for (args, code, words) in [
        (&[][..], 2, &["no pipeline.toml here", "satphot fetch elements"][..]),
        (&["elements", "-o", "x.json"], 2, &["which object?", "--norad 25544"]),
        (&["elements", "--norad", "25544"], 2, &["say where the elements go"]),
        (&["stars", "-o", "x.csv"], 2, &["needs a field: --ra-deg"]),
        (&["stars", "--ra-deg", "1", "--dec-deg", "2"], 2, &["say where the stars go"]),
        (&["stars", "--ra-deg", "1", "--dec-deg", "95", "-o", "x.csv"], 2, &["--dec-deg", "-90 to 90"]),
        (&["stars", "--ra-deg", "1", "--dec-deg", "2", "--radius-deg", "50", "-o", "x.csv"], 2, &["--radius-deg"]),
        (&["stars", "--norad", "1", "-o", "x.csv"], 2, &["--norad", "no effect"]),
        (&["elements", "--norad", "0", "-o", "x.json"], 2, &["--norad"]),
        (&["elements", "--norad", "25544", "--date", "soon", "-o", "x.json"], 2, &["--date", "soon"]),
        (&["elements", "--norad", "25544", "-o", "x.json", "--set", "fetch.update_h=0.1"], 2, &["fetch.update_h", "2"]),
        (
            &["elements", "--norad", "25544", "-o", "x.json", "--set", "fetch.timeout=1"],
            2,
            &["fetch.timeout", "timeout_s"],
        ),
        (&["-c", "none.toml"], 4, &["none.toml", "satphot init"]),
        (&["elements", "--norad", "25544", "-o", "x.json", "--offline"], 5, &["not in the cache"]),
    ] {
        place.fetch(&server, args).expect(code, words);
    }
    assert_eq!(server.count(), 0);
}

#[test]
fn frames_that_do_not_say_where_they_point_need_the_place_by_hand() {
    let (server, place) = (services(), Place::new());
    place.night().frame("field.fits", "OBJECT  = 'SA 92'\n");
    place.fetch(&server, &["stars"]).expect(4, &["none of 1 star frames says where it points", "--ra-deg"]);
    assert_eq!(server.count(), 0);
    place.fetch(&server, &["stars", "--ra-deg", "0.4", "--dec-deg", "-0.9"]).expect(0, &["wrote apass.csv"]);
    assert!(server.requests()[0].path.contains("&-c.r=0.500&-c.u=deg&"));
}

#[test]
fn the_columns_of_the_configuration_are_those_of_the_file_or_it_is_not_written() {
    let (server, place) = (services(), Place::new());
    place.night();
    let args = ["stars", "--set", "stars.columns={ v_mag = \"gmag\" }"];
    place.fetch(&server, &args).expect(5, &["apass.csv", "gmag"]);
    let left: Vec<_> = std::fs::read_dir(place.folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert!(left.iter().all(|n| !n.to_string_lossy().contains("apass")), "{left:?}");
}

#[test]
fn a_server_in_trouble_ends_with_code_75_and_leaves_no_file() {
    let place = Place::new();
    let hasty = ["--set", "fetch.backoff_s=0", "--set", "fetch.retries=1", "--set", "fetch.timeout_s=2"];
    for (reply, words) in [
        (Reply::status("500 Oops", HTML), "HTTP 500"),
        (Reply::status("403 Forbidden", HTML), "CelesTrak refuses: HTTP 403"),
        (Reply::ok(HTML), "HTML"),
        (Reply::ok(iss_of_today()).cut(), "middle of the answer"),
        (Reply::ok(iss_of_today()).after(Duration::from_secs(5)), "no answer within"),
    ] {
        let server = Server::always(reply);
        let cache = place.path(&format!("cache-{}", server.address().replace(':', "-")));
        let args = ["elements", "--norad", "25544", "-o", "iss.json", "--cache", cache.to_str().unwrap()];
        place.fetch(&server, &[&args[..], &hasty[..]].concat()).expect(75, &[words, "try again"]);
        assert!(!place.path("iss.json").exists(), "{words}");
    }
}

#[test]
fn two_processes_at_once_ask_once() {
    let server = Server::new(|_, _| Reply::ok(iss_of_today()).after(Duration::from_millis(300)));
    let place = Place::new();
    let start = |out: &str| -> Child {
        let mut command = place.command(&server, &["elements", "--norad", "25544", "-o", out]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let both = [start("a.json"), start("b.json"), start("c.json")];
    for child in both {
        Said::of(child.wait_with_output().unwrap()).expect(0, &[]);
    }
    assert_eq!(server.count(), 1);
    assert_eq!(std::fs::read(place.path("a.json")).unwrap(), std::fs::read(place.path("c.json")).unwrap());
}

#[test]
fn a_cache_that_cannot_be_written_is_reported_and_does_not_matter() {
    let (server, place) = (services(), Place::new());
    std::fs::write(place.path("file"), "").unwrap(); // a folder inside a file: nobody can make it, root neither
    let args = ["elements", "--norad", "25544", "--cache", "file/cache", "--force", "-o", "iss.json"];
    place.fetch(&server, &args).expect(0, &["not kept in the cache", "--cache names another folder", "wrote iss.json"]);
    place.fetch(&server, &args).expect(0, &[]);
    assert_eq!(server.count(), 2);
}

#[test]
fn the_proxy_of_the_environment_is_used_and_no_proxy_obeyed() {
    // the proxy is the server itself: it lets CONNECT through and answers what comes then
    let (proxy, place) = (services(), Place::new());
    let fetch = |server: &Server, out: &str, cache: &str, host: &str, variables: &[(&str, String)]| {
        let url = format!("http://{host}/gp.php");
        let mut command = place.command(server, &["elements", "--norad", "25544", "-o", out, "--cache", cache]);
        command.arg("--set").arg("fetch.retries=0").arg("--json");
        let args: Vec<_> = command.get_args().map(|a| a.to_owned()).collect();
        let args: Vec<_> =
            args.into_iter().map(|a| if a == *server.url("gp.php") { url.clone().into() } else { a }).collect();
        let mut fresh = Command::new(env!("CARGO_BIN_EXE_satphot"));
        fresh
            .current_dir(place.folder.path())
            .args(args)
            .env_remove("NO_PROXY")
            .env_remove("no_proxy")
            .env_remove("ALL_PROXY");
        variables.iter().for_each(|(k, v)| {
            fresh.env(k, v);
        });
        Said::of(fresh.output().unwrap())
    };
    let by = [("HTTPS_PROXY", format!("http://{}", proxy.address()))];
    // a host that only the proxy could know
    fetch(&proxy, "a.json", "c1", "celestrak.invalid", &by).expect(0, &["wrote a.json"]);
    assert_eq!(proxy.requests()[0].through.as_deref(), Some("celestrak.invalid:80"));
    // hosts of NO_PROXY are asked directly
    let direct = [by[0].clone(), ("NO_PROXY", "127.0.0.1,localhost".to_owned())];
    fetch(&proxy, "b.json", "c2", &proxy.address(), &direct).expect(0, &[]);
    assert_eq!(proxy.requests()[1].through, None);
    // a proxy that is not there is named, without its password
    let dead = [("HTTPS_PROXY", "http://me:secret@127.0.0.1:9".to_owned())];
    let said = fetch(&proxy, "d.json", "c3", "celestrak.invalid", &dead).expect(75, &["the proxy 127.0.0.1:9"]);
    assert!(!said.err.contains("secret"), "{}", said.err);
    let rubbish = [("HTTPS_PROXY", "ftp://x".to_owned())];
    fetch(&proxy, "e.json", "c4", "celestrak.invalid", &rubbish).expect(2, &["HTTPS_PROXY"]);
}

#[test]
fn messages_elsewhere_name_the_fetch_line_that_helps() {
    let place = Place::new();
    place.night();
    let run = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_satphot"));
        Said::of(command.current_dir(place.folder.path()).args(args).output().unwrap())
    };
    run(&["run", "pipeline.toml"]).expect(5, &["satphot fetch elements -c"]);
    let site = ["--site=-33.77,151.11,70", "--start", "2024-01-30T00:00:00"];
    run(&[&["passes", "--elements", "no.tle"], &site[..]].concat()).expect(5, &["satphot fetch elements", "-o no.tle"]);
    std::fs::write(place.path("elements.tle"), ELEMENTS[0].1).unwrap();
    run(&["run", "pipeline.toml"]).expect(5, &["apass.csv", "satphot fetch stars -c"]);
    run(&[&["passes", "--elements", "elements.tle"], &site[..]].concat())
        .expect(5, &["satphot fetch elements", "--date 2024-01-30"]);
}

#[test]
fn help_shows_an_example_of_each_use() {
    let help = Command::new(env!("CARGO_BIN_EXE_satphot")).args(["fetch", "--help"]).output().unwrap();
    let text = String::from_utf8_lossy(&help.stdout).into_owned();
    for line in
        ["satphot fetch -c night.toml", "satphot fetch elements --norad 25544", "satphot fetch stars", "XDG_CACHE_HOME"]
    {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/fetch.md").exists());
}
