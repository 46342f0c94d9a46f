//! The shell of all pages: a single file with its style, scripts, data and pictures.

use serde::Serialize;

use super::store::unix_s;
use crate::output::svg::escape;

/// The parts of a page that the shell does not have.
pub struct Page<'a> {
    pub title: &'a str,
    /// A sentence about the measured subjects and the devices.
    pub about: &'a str,
    /// Sentences about missing parts.
    pub missing: &'a str,
    /// Whether the program still fills the folder, so that the page reloads itself.
    pub running: bool,
    /// Style rules in addition to those of the shell.
    pub style: &'a str,
    /// The controls and the main part in HTML.
    pub body: &'a str,
    /// The page's own script, which runs after those of the shell.
    pub program: &'a str,
}

/// The data for the page's scripts.
#[derive(Serialize)]
struct Data<'a, T> {
    #[serde(flatten)]
    data: &'a T,
    running: bool,
    written_unix_s: u64,
}

impl Page<'_> {
    /// The bytes of `index.html`. `data` is an object for the scripts, with the stored rows.
    pub fn html(&self, data: &impl Serialize) -> String {
        let data = Data { data, running: self.running, written_unix_s: unix_s() };
        let data = serde_json::to_string(&data)
            .expect("rows are plain data, which JSON can hold")
            // The text of a script must not contain its end tag.
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
        // The data comes last, so that no text in it is mistaken for a placeholder.
        page.replace("{{data}}", &data)
    }
}
