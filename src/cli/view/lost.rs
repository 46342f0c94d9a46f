//! Devices that were lost, the window's own and the one that makes frames, are opened anew: a driver that was reset gives up every
//! device at once. One that is lost again soon is not.

use std::time::{Duration, Instant};

use anyhow::{Context as _, anyhow};
use ash::vk;

use super::{App, Shown};
use crate::cli::out;

/// A device that is lost again within this time stays lost.
const AGAIN: Duration = Duration::from_secs(10);

impl App {
    /// Opens the window's device anew where the error says that it was lost; any other one is returned.
    pub(super) fn recover(&mut self, error: anyhow::Error) -> anyhow::Result<()> {
        if error.downcast_ref() != Some(&vk::Result::ERROR_DEVICE_LOST) {
            return Err(error);
        }
        note_loss(&mut self.lost.window, "the window's device")?;
        let Shown { egui, screen, window } = self.shown.take().context("a device without a window was lost")?;
        drop((egui, screen)); // the window takes one swapchain at a time
        self.show_in(window)?;
        self.redraw();
        Ok(())
    }

    /// Opens the device that makes frames anew, and starts over.
    pub(super) fn renew_context(&mut self) -> anyhow::Result<()> {
        note_loss(&mut self.lost.frames, &self.context.name)?;
        self.worker = None; // what it made goes with the device
        self.context = self.run.device.open(self.subject.args.size)?;
        self.start();
        Ok(())
    }
}

/// When devices were opened anew last.
#[derive(Default)]
pub struct Losses {
    window: Option<Instant>,
    frames: Option<Instant>,
}

fn note_loss(last: &mut Option<Instant>, what: &str) -> anyhow::Result<()> {
    if last.is_some_and(|at| at.elapsed() < AGAIN) {
        let remedy = "ask for less, such as a smaller window";
        return Err(anyhow!("{what} was lost again, soon after it was opened anew: {remedy}"));
    }
    *last = Some(Instant::now());
    out::warn(&format!("{what} was lost, and is opened anew"));
    Ok(())
}
