//! The panel: settings, layers, exposure, and the times of the frame.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use twobounce::output::display::ToneMap;
use twobounce::settings::{PRESETS, Range, Settings};
use twobounce::vk::Step;

use super::beside::{Mix, Mixing, Other};
use super::job::{PanelChoice, ShownFrame};
use super::layer::{GridLayer, LEVELS, Layer, SIDES};
use super::question::{Cost, GatherRay, Question, Reply};
use super::times::{self, History};
use super::truth::Compared;
use super::{KEYS, overlay};

/// The time for which a message about a key is shown.
const SAID_FOR: Duration = Duration::from_secs(4);

#[derive(Default)]
pub struct Panel {
    pub open: bool,
    pub preset: String,
    pub choice: PanelChoice,
    /// The display of both pictures, if there are two.
    pub mixing: Mixing,
    /// Whether the path tracer runs for a picture at rest.
    pub truth: bool,
    /// The blend from image to reference to error: see [`Compared::picture`].
    pub fade: f32,
    /// The reason why a setting or a scene was refused, until the next one.
    pub error: Option<String>,
    /// A message about a key, and the time at which it appeared.
    said: Option<(String, Instant)>,
    /// The reason why there is no frame of the current job.
    pub frame_error: Option<String>,
    /// The reason why saved GLSL is not in use.
    pub shader_error: Option<String>,
    /// Values that are being typed.
    typed: BTreeMap<&'static str, String>,
    all: bool,
    /// Whether the grids' boxes are shown.
    pub bounds: bool,
    pub history: History,
    /// A question to the thread that makes frames, until the thread takes it.
    pub question: Option<Question>,
    /// Costs of frames with other values of a setting, with these other settings.
    costs: (BTreeMap<&'static str, Vec<Cost>>, Settings),
    /// The rays of a pixel.
    pub rays: Vec<GatherRay>,
}

impl Panel {
    pub fn new(preset: &str, choice: PanelChoice) -> Self {
        Self {
            open: true,
            preset: preset.to_owned(),
            costs: (BTreeMap::new(), choice.settings.clone()),
            choice,
            mixing: Mixing { split: 0.5, ..Mixing::default() },
            ..Self::default()
        }
    }

    /// Receives the answer to a question.
    pub fn take(&mut self, found: Result<Reply, String>) {
        self.error = None;
        match found {
            Ok(Reply::Rays(rays)) => self.rays = rays,
            Ok(Reply::Cost(key, costs)) => drop(self.costs.0.insert(key, costs)),
            Err(words) => self.error = Some(words),
        }
    }

    /// The costs of settings as text, for tests.
    pub fn costs_in_words(&self) -> String {
        let of = |(key, costs): (&&str, &Vec<Cost>)| {
            let values: Vec<String> = costs.iter().map(Cost::in_words).collect();
            format!("{key}: {}", values.join(", "))
        };
        self.costs.0.iter().map(of).collect::<Vec<_>>().join("; ")
    }

    /// Shows the panel.
    pub fn show(
        &mut self,
        context: &egui::Context,
        frame: Option<&ShownFrame>,
        compared: Option<&Compared>,
        step: Option<Step>,
    ) {
        if let Some(words) = &self.shader_error {
            let place = (egui::Align2::LEFT_BOTTOM, (8.0, -8.0));
            egui::Window::new("GLSL").anchor(place.0, place.1).show(context, |ui| {
                ui.label(egui::RichText::new(words).monospace().color(egui::Color32::LIGHT_RED));
            });
        }
        if !self.open {
            return;
        }
        let height = context.content_rect().height() - 60.0;
        egui::Window::new("twobounce").default_size((320.0, height)).default_pos((8.0, 8.0)).show(context, |ui| {
            egui::ScrollArea::vertical().max_height(height).show(ui, |ui| {
                ui.label(match (step, frame) {
                    (Some(step), _) => format!("{} {:.0} %", step.pass, 100.0 * step.share),
                    (None, Some(frame)) => format!("{:.0} ms, input to picture{}", frame.ms, frame.refined()),
                    (None, None) => "preparing the scene".into(),
                });
                self.show_view(ui, frame);
                ui.checkbox(&mut self.truth, "error against the path tracer");
                if self.truth {
                    let slider = egui::Slider::new(&mut self.fade, 0.0..=2.0).show_value(false);
                    ui.add(slider.text("image, reference, FLIP"));
                    ui.label(compared.map_or("the path tracer starts when nothing moves".into(), Compared::in_words));
                }
                ui.collapsing("settings", |ui| self.show_settings(ui));
                if let Some(frame) = frame {
                    ui.collapsing("times", |ui| times::show(ui, frame, &self.history));
                }
                if !self.rays.is_empty() {
                    ui.collapsing("rays of a pixel", |ui| overlay::show_rays(ui, &self.rays));
                }
                ui.collapsing("keys", |ui| ui.label(KEYS));
            });
        });
    }

    /// Shows a message for some seconds.
    pub fn say(&mut self, words: String) {
        self.said = Some((words, Instant::now()));
    }

    /// Removes an expired message. Returns whether there was one.
    pub fn forgets(&mut self) -> bool {
        self.said.take_if(|(_, since)| since.elapsed() > SAID_FOR).is_some()
    }

    /// Errors and the last message, below the picture's middle, where they move nothing else.
    pub fn show_notice(&mut self, context: &egui::Context) {
        let errors = self.error.iter().chain(&self.frame_error).map(|words| (words, egui::Color32::LIGHT_RED));
        let said = self.said.iter().map(|(words, _)| (words, egui::Color32::LIGHT_GRAY));
        let lines: Vec<_> = errors.chain(said).collect();
        if lines.is_empty() {
            return;
        }
        let area =
            egui::Area::new("notice".into()).anchor(egui::Align2::CENTER_BOTTOM, (0.0, -16.0)).interactable(false);
        area.show(context, |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                lines.into_iter().for_each(|(words, color)| drop(ui.colored_label(color, words)));
            });
        });
    }

    fn show_view(&mut self, ui: &mut egui::Ui, frame: Option<&ShownFrame>) {
        egui::ComboBox::from_label("preset").selected_text(&self.preset).show_ui(ui, |ui| {
            for preset in PRESETS {
                let chosen = ui.selectable_label(self.preset == preset.name, preset.name).on_hover_text(preset.meaning);
                if chosen.clicked() {
                    self.preset = preset.name.to_owned();
                    self.choice.settings = (preset.settings)();
                    self.typed.clear();
                }
            }
        });
        if !self.choice.layer.is_made_with(&self.choice.settings) {
            self.choice.layer = Layer::BEAUTY;
        }
        let (name, meaning) = self.choice.layer.label();
        egui::ComboBox::from_label("layer").selected_text(name).height(400.0).show_ui(ui, |ui| {
            for layer in Layer::all().filter(|layer| layer.is_made_with(&self.choice.settings)) {
                ui.selectable_value(&mut self.choice.layer, layer, layer.label().0);
            }
        });
        if !meaning.is_empty() {
            ui.label(meaning);
        }
        if let Layer::Grid(GridLayer::Volume(side)) = &mut self.choice.layer {
            ui.horizontal(|ui| {
                egui::ComboBox::from_label("way").selected_text(SIDES[side.face]).show_ui(ui, |ui| {
                    for (face, name) in SIDES.into_iter().enumerate() {
                        ui.selectable_value(&mut side.face, face, name);
                    }
                });
                ui.add(egui::Slider::new(&mut side.level, 0..=LEVELS - 1).text("level"));
                ui.selectable_value(&mut side.bounce, 0, "bounce 1");
                ui.selectable_value(&mut side.bounce, 1, "2");
            });
        }
        ui.checkbox(&mut self.bounds, "bounds of the grids");
        egui::ComboBox::from_label("beside").selected_text(self.choice.beside.name()).show_ui(ui, |ui| {
            for other in Other::all() {
                ui.selectable_value(&mut self.choice.beside, other, other.name());
            }
        });
        if let Some(beside) = frame.and_then(|frame| Some((frame.report.timings.gpu_ms, frame.beside.as_ref()?.gpu_ms)))
        {
            ui.horizontal(|ui| {
                for (mix, name) in Mix::ALL {
                    ui.selectable_value(&mut self.mixing.mix, mix, name);
                }
                if self.mixing.mix == Mix::Split {
                    ui.add(egui::Slider::new(&mut self.mixing.split, 0.0..=1.0).show_value(false));
                }
            });
            ui.label(format!("passes {:.1} ms, beside {:.1} ms", beside.0, beside.1));
        }
        let automatic = frame.map_or(0.0, |frame| frame.display.exposure_ev);
        ui.horizontal(|ui| {
            let mut own = self.choice.exposure.is_some();
            ui.checkbox(&mut own, "exposure");
            self.choice.exposure = own.then_some(self.choice.exposure.unwrap_or(automatic));
            match &mut self.choice.exposure {
                Some(ev) => drop(ui.add(egui::Slider::new(ev, -10.0..=10.0).suffix(" EV"))),
                None => drop(ui.label(format!("{automatic} EV, automatic"))),
            }
        });
        egui::ComboBox::from_label("tone curve").selected_text(self.choice.tone.name()).show_ui(ui, |ui| {
            for tone in ToneMap::ALL {
                ui.selectable_value(&mut self.choice.tone, *tone, tone.name());
            }
        });
        let refine = egui::Slider::new(&mut self.choice.refine, 1..=4096).logarithmic(true);
        ui.add(refine.text("passes at rest"))
            .on_hover_text("shows the mean of this many passes; C prints a command with as many");
    }

    fn show_settings(&mut self, ui: &mut egui::Ui) {
        ui.checkbox(&mut self.all, "all, with rare ones");
        if self.costs.1 != self.choice.settings {
            self.costs = (BTreeMap::new(), self.choice.settings.clone());
        }
        let mut sets = vec![];
        for (key, value) in self.choice.settings.entries() {
            if key.rare && !self.all {
                continue;
            }
            let hover = format!("{}\n[{}] takes {}\ncost: {}", key.meaning, key.unit, key.range, key.cost);
            ui.horizontal(|ui| {
                let mut set = |value: &str| sets.push(format!("{}={value}", key.name));
                match key.range {
                    Range::Choice(names) => {
                        drop(egui::ComboBox::from_id_salt(key.name).selected_text(&value).show_ui(ui, |ui| {
                            for name in names() {
                                if ui.selectable_label(value == name, name).clicked() {
                                    set(name);
                                }
                            }
                        }))
                    }
                    Range::Bool => {
                        let mut on = value == "true";
                        if ui.checkbox(&mut on, "").clicked() {
                            set(if on { "true" } else { "false" });
                        }
                    }
                    _ => {
                        let typed = self.typed.entry(key.name).or_insert_with(|| value.clone());
                        let edit = ui.add(egui::TextEdit::singleline(typed).desired_width(70.0));
                        if edit.lost_focus() && *typed != value {
                            set(typed);
                        } else if !edit.has_focus() && *typed != value {
                            typed.clone_from(&value);
                        }
                    }
                }
                ui.label(key.name).on_hover_text(hover);
                if ui.small_button("ms").on_hover_text("measure a frame with this value and others").clicked() {
                    self.question = Some(Question::Cost(key.name));
                }
            });
            for cost in self.costs.0.get(key.name).into_iter().flatten() {
                let words = egui::RichText::new(cost.in_words());
                ui.label(if cost.is_now { words.strong() } else { words });
            }
        }
        for set in sets {
            self.error = self.choice.settings.set(&set).err().map(|error| error.to_string());
        }
    }
}
