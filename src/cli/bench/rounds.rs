//! Measurement of missing rows against rough references, then refinement of references and errors in rounds.

use std::sync::Arc;

use twobounce::chart::measure::{Images, ReferenceImage};
use twobounce::chart::outline::Outline;
use twobounce::chart::row::{Measured, Row, Source};
use twobounce::lab::store::{ExperimentRow as _, Store, Stored};
use twobounce::layers::Layers;
use twobounce::output::exr::Metadata;
use twobounce::output::file;
use twobounce::reference::{Depth, Stop};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::Filling;
use crate::cli::interrupt;
use crate::cli::lab::{Experiment, Pages};
use crate::cli::reference::traced;
use crate::cli::report::say_compiled;
use crate::say;

/// The factor by which a round reduces the noise of references, in about ten times the time.
const STEP: f64 = 3.0;

/// The ratio of noise to the requested noise below which no round is worthwhile.
const CLOSE: f64 = 1.5;

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

    fn measure(&mut self, row: usize, context: &Arc<Context>, go_on: &dyn Fn() -> Result<()>) -> Result<()> {
        let planned = &self.rows[row];
        let scene = &self.scenes[planned.scene];
        let (measured, pictures, images) = scene.measure(context, &planned.row, &interrupt::PRESSED, go_on)?;
        // The place and time of comparison do not matter for another program's image, which stays in its own file.
        let is_import = planned.row.is_import();
        let origin = (!is_import).then(|| self.origin.now());
        let kept = Row { measured: Some(measured), origin, ..planned.row.clone() };
        if !is_import && kept.noise() > self.bench.args.reference_noise {
            // Images are stored for the rounds as layers without metadata.
            file::create_folder(&self.store.path("rows"))?;
            images.stacked().write_exr(&self.store.image_path(&kept.key), &Metadata::new())?;
        }
        self.rows[row].stored = Some(self.store.save(kept, Some(pictures))?);
        if !is_import && !std::mem::replace(&mut self.told, true) {
            say_compiled(context);
        }
        Ok(())
    }

    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()> {
        let planned = &self.rows[row].row;
        if planned.is_import() {
            return Err(error);
        }
        let kept = Row { failure: Some(error.to_string()), origin: Some(self.origin.now()), ..planned.clone() };
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
    /// The scene of a row, and the depths of its references.
    fn depths(&self, index: usize) -> (usize, [Depth; 2]) {
        let planned = &self.rows[index];
        (planned.scene, planned.row.depths(&self.scenes[planned.scene]))
    }

    /// Makes the first, rough references of a row.
    fn first_references(&mut self, index: usize) -> Result<()> {
        let (scene, depths) = self.depths(index);
        for depth in depths {
            if self.scenes[scene].noise(depth).is_none() {
                self.next_reference(scene, depth)?;
            }
        }
        Ok(())
    }

    /// Makes a reference with the precision of the next round, or takes it from the cache: first of a few samples, then
    /// with decreasing noise, finally the one that `reference --noise` makes.
    fn next_reference(&mut self, scene: usize, depth: Depth) -> Result<()> {
        let (scene, last) = (&mut self.scenes[scene], self.bench.args.reference_noise);
        let noise = scene.noise(depth).map_or(f64::INFINITY, |now| now / STEP);
        let noise = if noise < CLOSE * last { last } else { noise };
        let options = scene.reference_options(depth, Stop::Rough { noise, last });
        let (film, traced) = traced(&self.cache, scene.still(), &options)?;
        let light = match depth {
            Depth::Full => "all light".to_owned(),
            Depth::Bounces(n) => format!("light of {n} indirect bounces"),
        };
        let how = if traced.paths == 0 { "from the cache".into() } else { format!("{:.1} s", traced.seconds) };
        let (name, percent) = (&scene.name, 100.0 * film.noise());
        say!("{name}: reference of {light}, noise {percent:.2} %, {how}");
        let reference = ReferenceImage::of_film(depth, &film)
            .map_err(|error| Error::Usage(format!("{name}: {error}; light the scene")))?;
        scene.set_reference(reference);
        Ok(())
    }

    /// Refines references and the errors of their rows in rounds, until the requested precision. Times are not measured
    /// again.
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

    /// Makes rough references of scenes that have rows but no reference for pages, in a folder without an outline.
    pub(super) fn show_scenes(&mut self) -> Result<()> {
        let known = Store::<Row>::outline(&self.store.path("")).map_or(Vec::new(), |outline: Outline| outline.scenes);
        for index in 0..self.rows.len() {
            let scene = &self.scenes[self.rows[index].scene];
            let is_known =
                known.iter().any(|sketch| sketch.line.name == scene.name && sketch.line.hash == scene.scene.hash);
            if self.rows[index].is_measured() && !is_known {
                self.first_references(index)?;
            }
        }
        Ok(())
    }

    /// Whether a row's errors do not have the requested precision yet.
    fn is_unsettled(&self, index: usize) -> bool {
        let measured = self.rows[index].stored.as_ref().filter(|stored| stored.row.is_measured());
        measured.is_some_and(|stored| stored.row.noise() > self.bench.args.reference_noise)
    }

    /// References of unsettled rows with more than the requested noise, the noisiest first.
    fn rough_references(&self) -> Vec<(usize, Depth)> {
        let mut rough: Vec<(f64, usize, Depth)> = Vec::new();
        for index in (0..self.rows.len()).filter(|index| self.is_unsettled(*index)) {
            let (scene, depths) = self.depths(index);
            for depth in depths {
                let noise = self.scenes[scene].noise(depth).filter(|noise| *noise > self.bench.args.reference_noise);
                let is_new = rough.iter().all(|(_, other, of)| (*other, *of) != (scene, depth));
                rough.extend(noise.filter(|_| is_new).map(|noise| (noise, scene, depth)));
            }
        }
        rough.sort_by(|a, b| b.0.total_cmp(&a.0));
        rough.into_iter().map(|(_, scene, depth)| (scene, depth)).collect()
    }

    /// Compares the image of an unsettled row with the current references, if one has less noise than before. A row
    /// without its image is measured by the next call.
    fn judge_again(&mut self, index: usize) -> Result<()> {
        let (scene, depths) = self.depths(index);
        let scene = &self.scenes[scene];
        let planned = &self.rows[index];
        let row = planned.stored.as_ref().map(|stored| &stored.row);
        let Some((row, measured)) = row.and_then(|row| Some((row, row.measured.as_ref()?))) else { return Ok(()) };
        let better = |(depth, noise)| scene.noise(depth).is_some_and(|now| now < noise);
        let is_better = [(depths[0], measured.full.noise), (depths[1], measured.same.noise)].into_iter().any(better);
        if !self.is_unsettled(index) || !is_better {
            return Ok(());
        }
        let path = self.store.image_path(&row.key);
        let images = match &planned.row.source {
            Source::Import(claim) => claim.images()?,
            _ => {
                let Ok((stacked, _)) = Layers::read_exr(&path) else {
                    say!("{}: its image is gone; the same command measures it again", row.title());
                    self.rows[index].stored = None;
                    return Ok(());
                };
                Images::unstacked(stacked, self.bench.scene.size.1)
            }
        };
        let ([full, same], pictures) = scene.judge(&planned.row, &images)?;
        let measured = Some(Measured { full, same, ..measured.clone() });
        let stored: Stored<Row> = self.store.save(Row { measured, ..row.clone() }, Some(pictures))?;
        self.rows[index].stored = Some(stored);
        if !self.is_unsettled(index) {
            // An image that is no longer needed is deleted.
            let _ = std::fs::remove_file(path);
        }
        Ok(())
    }
}

/// A finished row as a line.
fn result_of(row: &Row) -> String {
    let result = match &row.measured {
        Some(measured) => {
            let (full, same) = (measured.full.metrics.total.rel, measured.same.metrics.total.rel);
            let (ms, given) = (row.ms().unwrap_or_default(), if row.is_import() { " as given" } else { "" });
            format!("{ms:.0} ms{given}, rel {full:.3} of all light, {same:.3} of as many bounces")
        }
        None => row.failure.clone().unwrap_or_default(),
    };
    format!("{}: {result}", row.title())
}
