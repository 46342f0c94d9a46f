//! The work itself: missing rows against rough references, then references and errors in rounds.

use std::sync::Arc;

use twobounce::chart::measure::Images;
use twobounce::chart::outline::Outline;
use twobounce::chart::row::{Measured, Row};
use twobounce::chart::subject::Subject;
use twobounce::lab::store::{Origin, Row as _, Stored};
use twobounce::layers::Layers;
use twobounce::output::exr::Metadata;
use twobounce::reference::Depth;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::Filling;
use crate::cli::lab::{Experiment, Pages};
use crate::cli::report::say_compiled;
use crate::cli::{interrupt, share};
use crate::say;

impl Experiment for Filling<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn is_measured(&self, row: usize) -> bool {
        self.rows[row].is_measured()
    }

    fn name(&self, row: usize) -> String {
        self.rows[row].row.title()
    }

    fn prepare(&mut self, row: usize) -> Result<()> {
        self.first_references(row)
    }

    fn measure(&mut self, row: usize, context: &Arc<Context>, go_on: &dyn Fn() -> bool) -> Result<bool> {
        let planned = &self.rows[row];
        let scene = &self.scenes[planned.scene].scene;
        let found = match planned.subject {
            Subject::Settings(trial) => scene.measure_settings(context, trial, go_on)?,
            Subject::Paths(paths) => scene.measure_paths(*paths, &interrupt::PRESSED, go_on)?,
            Subject::Import(import) => {
                let (measured, pictures) = scene.measure_import(import)?;
                // Where and when it was judged says nothing about it, and its image stays in its own file.
                let kept = Row { measured: Some(measured), ..planned.row.clone() };
                self.rows[row].stored = Some(self.store.save(kept, Some(pictures))?);
                return Ok(true);
            }
        };
        let Some((measured, pictures, images)) = found else { return Ok(false) };
        let kept = Row { measured: Some(measured), origin: self.now(), ..planned.row.clone() };
        if !kept.is_within(self.bench.args.reference_noise) {
            self.keep_images(&kept.key, &images)?;
        }
        self.rows[row].stored = Some(self.store.save(kept, Some(pictures))?);
        if !std::mem::replace(&mut self.told, true) {
            say_compiled(context);
        }
        Ok(true)
    }

    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()> {
        let planned = &self.rows[row];
        if matches!(planned.subject, Subject::Import(_)) {
            return Err(error);
        }
        let kept = Row { failure: Some(error.to_string()), origin: self.now(), ..planned.row.clone() };
        self.rows[row].stored = Some(self.store.save(kept, None)?);
        Ok(())
    }

    fn line(&self, row: usize) -> Option<String> {
        self.rows[row].stored.as_ref().map(|stored| result_of(&stored.row))
    }

    fn write(&mut self, running: bool) -> Result<()> {
        self.write_pages(running).map(drop)
    }
}

impl Filling<'_> {
    fn now(&self) -> Option<Origin> {
        Some(Origin { unix_s: share::unix_s(), ..self.origin.clone() })
    }

    /// The references that a row is compared with, as rough as they come.
    fn first_references(&mut self, index: usize) -> Result<()> {
        let (scene, subject) = (self.rows[index].scene, self.rows[index].subject);
        for depth in subject.depths(&self.scenes[scene].scene) {
            if self.noise(scene, depth).is_none() {
                self.next_reference(scene, depth)?;
            }
        }
        Ok(())
    }

    /// Keeps the images of a row for the rounds: layers without a word about them.
    fn keep_images(&self, key: &str, images: &Images) -> Result<()> {
        twobounce::output::file::create_folder(&self.store.path("rows"))?;
        images.stacked().write_exr(&self.store.image_path(key), &Metadata::new())
    }

    /// Refines references and the errors of the rows that are compared with them, in rounds, until they are as good as asked for.
    /// Times are not measured again.
    pub(super) fn refine(&mut self, pages: &mut Pages) -> Result<()> {
        for index in 0..self.rows.len() {
            if self.is_unsettled(index) {
                self.first_references(index)?;
                self.judge_again(index)?;
            }
        }
        loop {
            let rough = self.rough_references();
            if rough.is_empty() {
                return Ok(());
            }
            for (scene, depth) in rough {
                self.next_reference(scene, depth)?;
                for index in 0..self.rows.len() {
                    interrupt::check()?;
                    self.judge_again(index)?;
                }
                pages.write_now_and_then(self)?;
            }
        }
    }

    /// Makes rough references of scenes that have rows but nothing to be seen with: of a folder that lacks its outline.
    pub(super) fn show_scenes(&mut self) -> Result<()> {
        let known = Outline::load(&self.store.path("")).map_or(Vec::new(), |outline| outline.scenes);
        for index in 0..self.rows.len() {
            let scene = &self.scenes[self.rows[index].scene].scene;
            let is_known =
                known.iter().any(|sketch| sketch.line.name == scene.name && sketch.line.hash == scene.scene.hash);
            if self.rows[index].is_measured() && !is_known {
                self.first_references(index)?;
            }
        }
        Ok(())
    }

    /// Whether a row's errors are not as good as asked for.
    fn is_unsettled(&self, index: usize) -> bool {
        let row = self.rows[index].stored.as_ref().map(|stored| &stored.row).filter(|row| row.measured.is_some());
        row.is_some_and(|row| !row.is_within(self.bench.args.reference_noise))
    }

    /// The references that are noisier than asked for and that unsettled rows are compared with, the noisiest first.
    fn rough_references(&self) -> Vec<(usize, Depth)> {
        let mut rough: Vec<(f64, usize, Depth)> = Vec::new();
        for index in (0..self.rows.len()).filter(|index| self.is_unsettled(*index)) {
            let (scene, subject) = (self.rows[index].scene, self.rows[index].subject);
            for depth in subject.depths(&self.scenes[scene].scene) {
                let noise = self.noise(scene, depth).filter(|noise| *noise > self.bench.args.reference_noise);
                let is_new = rough.iter().all(|(_, other, of)| (*other, *of) != (scene, depth));
                rough.extend(noise.filter(|_| is_new).map(|noise| (noise, scene, depth)));
            }
        }
        rough.sort_by(|a, b| b.0.total_cmp(&a.0));
        rough.into_iter().map(|(_, scene, depth)| (scene, depth)).collect()
    }

    /// Compares the image of an unsettled row with the references of now, where one has less noise than before. A row whose image
    /// is gone is measured by the next call.
    fn judge_again(&mut self, index: usize) -> Result<()> {
        if !self.is_unsettled(index) || !self.has_better_truth(index) {
            return Ok(());
        }
        let last = self.bench.args.reference_noise;
        let planned = &mut self.rows[index];
        let Some(Stored { row, .. }) = &planned.stored else { return Ok(()) };
        let path = self.store.image_path(&row.key);
        let images = match planned.subject {
            Subject::Import(import) => import.images()?,
            Subject::Settings(_) | Subject::Paths(_) => {
                let Ok((stacked, _)) = Layers::read_exr(&path) else {
                    say!("{} {}: its image is gone; the same command measures it again", row.scene, row.name);
                    planned.stored = None;
                    return Ok(());
                };
                Images::unstacked(stacked, self.bench.scene.size.1)
            }
        };
        let ([full, same], pictures) = self.scenes[planned.scene].scene.judge(planned.subject, &images)?;
        let measured = row.measured.clone().map(|measured| Measured { full, same, ..measured });
        let stored = self.store.save(Row { measured, ..row.clone() }, Some(pictures))?;
        if stored.row.is_within(last) {
            // What is left over only takes room.
            let _ = std::fs::remove_file(path);
        }
        planned.stored = Some(stored);
        Ok(())
    }

    /// Whether a reference has less noise by now than when this row was compared with it.
    fn has_better_truth(&self, index: usize) -> bool {
        let planned = &self.rows[index];
        let Some(measured) = planned.stored.as_ref().and_then(|stored| stored.row.measured.as_ref()) else {
            return false;
        };
        let depths = planned.subject.depths(&self.scenes[planned.scene].scene);
        let better = |depth, noise| self.noise(planned.scene, depth).is_some_and(|now| now < noise);
        better(depths[0], measured.full.noise) || better(depths[1], measured.same.noise)
    }
}

/// A finished row in a line.
fn result_of(row: &Row) -> String {
    let result = match &row.measured {
        Some(measured) => {
            let (full, same) = (measured.full.total.rel, measured.same.total.rel);
            let (ms, given) = (row.ms().unwrap_or_default(), row.source.word() == "import");
            let given = if given { " as given" } else { "" };
            format!("{ms:.0} ms{given}, rel {full:.3} of all light, {same:.3} of as many bounces")
        }
        None => row.failure.clone().unwrap_or_default(),
    };
    format!("{} {}: {result}", row.scene, row.name)
}
