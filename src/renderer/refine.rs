//! Progressive refinement: light bounces on until it has settled, then further passes over the light are averaged, and
//! passes over the image. [`Renderer::render`] makes them all; a window shows what there is in between.

use super::{FrameReport, Renderer};
use crate::Result;
use crate::gi::CoarseLight;
use crate::layers::PassMean;
use crate::scene::{Pose, View};
use crate::vk;

impl Renderer {
    /// Renders one frame and waits for it. Buffers that turn out too small grow, and the frame is repeated. With
    /// `bounces = all` the first frame is repeated until it settles: until the light changes by less than
    /// [`super::SETTLED`] from one to the next, [`MOST_SETTLING`](crate::frame::MOST_SETTLING) times at most, and as
    /// often again as the method takes a mean of.
    ///
    /// # Errors
    /// A buffer cannot grow as far as the scene needs, the device is lost, or what watches says so.
    pub fn render(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let (mut settling, mut repeats, before) = (0, 0, vk::process_cpu_ms());
        while let Some(pass) = self.light_pass(pose, view)? {
            repeats += pass.repeats;
            settling += 1;
        }
        let mut report = self.render_now(pose, view)?;
        for _ in 1..self.settings.image.passes {
            report = report.then(self.refine(pose, view)?);
        }
        let cpu_ms = vk::process_cpu_ms().zip(before).map(|(after, before)| after - before);
        Ok(FrameReport { repeats: repeats + report.repeats, settling, cpu_ms, ..report })
    }

    /// One of the passes over the light that [`Self::render`] makes before its image; none where
    /// [`Self::light_is_whole`].
    ///
    /// # Errors
    /// As for [`Self::render`].
    pub fn light_pass(&mut self, pose: &Pose, view: &View) -> Result<Option<FrameReport>> {
        if self.light_is_whole() { Ok(None) } else { self.draw(pose, view, None).map(Some) }
    }

    /// Whether what stands still is lit by as many passes as [`Self::render`] makes: with `bounces = all` that takes
    /// some.
    pub fn light_is_whole(&self) -> bool {
        !self.frame.light.is_awaited()
    }

    /// An image of one pass, with the light as far as it has come, and brings that further by one pass where it is not
    /// whole.
    ///
    /// # Errors
    /// As for [`Self::render`].
    pub fn render_now(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        self.mean = None;
        self.draw(pose, view, Some(0))
    }

    /// One more pass over the last image, whose mean with those before is read from then on: what [`Self::render`]
    /// shows where `image.passes` is as high. The report is of this pass; its noise is the mean's.
    ///
    /// # Errors
    /// As for [`Self::render`]; the mean then is as before.
    pub fn refine(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let first = || {
            let mut mean = PassMean::default();
            mean.add(&self.readback.read(&self.options.aovs));
            mean
        };
        let mut mean = self.mean.take().unwrap_or_else(first);
        let drawn = self.draw(pose, view, Some(mean.passes()));
        if drawn.is_ok() {
            mean.add(&self.readback.read(&self.options.aovs));
        }
        let noise = mean.noise();
        self.mean = Some(mean);
        Ok(FrameReport { noise, ..drawn? })
    }

    /// Passes over the image that what is read is the mean of.
    pub fn passes(&self) -> u32 {
        self.mean.as_ref().map_or(1, PassMean::passes)
    }

    /// A pass over the light was made: measures it, as long as it is waited for to settle.
    pub(super) fn light_made(&mut self) -> Result<()> {
        if self.frame.light.is_measured() {
            let light = self.coarse_light()?;
            self.frame.light.measured(light);
        }
        Ok(())
    }

    /// Numbers that represent, coarsely, the light that the method holds.
    fn coarse_light(&self) -> Result<Vec<f64>> {
        let number = |bits: u16| half::f16::from_bits(bits).to_f64();
        Ok(match self.frame.method.coarse_light() {
            Some(CoarseLight::Image(image, level)) => {
                let texels: Vec<[u16; 4]> = vk::download_image(&self.context, image, level)?;
                texels.iter().flat_map(|t| t[..3].to_vec()).map(number).collect()
            }
            Some(CoarseLight::Sums(sums)) => {
                let sums: Vec<u64> = vk::download(&self.context, sums)?;
                sums.into_iter().map(|sum| sum as f64).collect()
            }
            Some(CoarseLight::Full(image)) => {
                let texels: Vec<[f32; 4]> = vk::download_image(&self.context, image, 0)?;
                texels.iter().flat_map(|t| t[..3].to_vec()).map(f64::from).collect()
            }
            None => vec![],
        })
    }
}
