//! The shell of all pages: one file with its style, its programs, its data and its pictures inside.

use serde::Serialize;

use super::store::unix_s;
use crate::output::svg::escape;

/// The parts of a page besides the shell.
pub struct Page<'a> {
    pub title: &'a str,
    /// The measured subjects and the devices, in a sentence.
    pub about: &'a str,
    /// The parts that are not there yet, in sentences.
    pub missing: &'a str,
    /// Whether the program still fills the folder: then the page looks for a newer one of itself.
    pub running: bool,
    /// Its own rules besides those of the shell.
    pub style: &'a str,
    /// The controls and the main part, HTML.
    pub body: &'a str,
    /// Its own program, which runs after those of the shell.
    pub program: &'a str,
}

/// The data that the page's programs read.
#[derive(Serialize)]
struct Data<'a, T> {
    #[serde(flatten)]
    data: &'a T,
    running: bool,
    written_unix_s: u64,
}

impl Page<'_> {
    /// The bytes of `index.html`. `data`: an object that the program reads, with the rows as they are kept.
    pub fn html(&self, data: &impl Serialize) -> String {
        let data = Data { data, running: self.running, written_unix_s: unix_s() };
        let data = serde_json::to_string(&data)
            .expect("rows are plain data, which JSON can hold")
            // Inside a script nothing may look like the script's end.
            .replace('<', "\\u003c");
        let page = include_str!("page/shell.html")
            .replace("{{title}}", &escape(self.title))
            .replace("{{base}}", include_str!("page/style.css"))
            .replace("{{style}}", self.style)
            .replace("{{about}}", &escape(self.about))
            .replace("{{missing}}", &escape(self.missing))
            .replace("{{body}}", self.body)
            .replace("{{shell}}", include_str!("page/shell.js"))
            .replace("{{plot}}", include_str!("page/plot.js"))
            .replace("{{program}}", self.program);
        // Last, so that no text in it is taken for a place to fill in.
        page.replace("{{data}}", &data)
    }
}
