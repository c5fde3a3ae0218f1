//! `satphot report`: the page of a night, or of several.

use std::path::PathBuf;

use clap::Args;
use satphot::Error;
use satphot::pipeline::products::page::{write_campaign_report, write_report};

use super::{print, tell};

const EXAMPLES: &str = "\
Examples:
  satphot report satphot-out/2025-06-09              writes report.html into that folder
  satphot report satphot-out/2025-06-09 -o night.html
  satphot report satphot-out/* -o campaign.html      several nights on one page

The page is one file that needs no network and can be printed. `satphot run` writes it at its end.";

/// Writes the report of a finished night as one HTML file; of several nights, a page that compares them.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Report {
    /// Folders of results, with photometry.ecsv in each
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// File to write [default: report.html in the folder; campaign.html here for several]
    #[arg(short, long, value_name = "FILE.html")]
    out: Option<PathBuf>,
}

impl Report {
    pub fn execute(self) -> anyhow::Result<()> {
        if let Some(out) = self.out.as_ref().filter(|o| o.extension().is_none_or(|e| !e.eq_ignore_ascii_case("html"))) {
            let problem = format!("{} does not end in .html", out.display());
            return Err(Error::Argument { name: "--out".into(), problem }.into());
        }
        let path = match self.folders.as_slice() {
            [folder] => write_report(folder, self.out.as_deref())?,
            folders => {
                let out = self.out.unwrap_or_else(|| "campaign.html".into());
                write_campaign_report(folders, &out)?.iter().for_each(|note| tell(&format!("note: {note}")));
                out
            }
        };
        print(&format!("{}\n", path.display()));
        Ok(())
    }
}
