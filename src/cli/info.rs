//! `twobounce info`: every Vulkan device, the requirements of twobounce, missing ones, and relevant limits.

use std::process::ExitCode;

use clap::Args;
use serde_json::{Value, json};
use twobounce::measure::timing::short_bytes;
use twobounce::renderer;
use twobounce::settings::{Conservative, PRESETS, Preset};
use twobounce::vk::{self, DeviceReport, Need};

#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Print JSON, with sizes in bytes
    #[arg(long)]
    pub json: bool,
}

/// Prints the list. Fails without a loader or a device.
pub fn run(args: &InfoArgs) -> anyhow::Result<ExitCode> {
    let devices = vk::devices()?;
    let text = if args.json { json(&devices) } else { text(&devices) };
    super::out::write(&text);
    Ok(ExitCode::SUCCESS)
}

fn text(devices: &[DeviceReport]) -> String {
    devices.iter().enumerate().map(|(index, device)| device_text(index, device)).collect::<Vec<_>>().join("\n")
}

fn device_text(index: usize, device: &DeviceReport) -> String {
    let (major, minor, patch) = device.api_version;
    let mut text = format!(
        "{index}: {}\n   {}, Vulkan {major}.{minor}.{patch}, driver {}\n",
        device.name,
        device.kind.name(),
        device.driver
    );
    let missing: Vec<_> = device.needs.iter().filter(|need| !need.present).map(|need| need.name.as_str()).collect();
    text += &match missing.is_empty() {
        true => "   has everything that twobounce needs:\n".to_owned(),
        false => format!("   cannot be used, it lacks {}:\n", missing.join(", ")),
    };
    let mut tell = |need: &Need, asks: &str| {
        text += &format!("     {} {}{asks}\n", if need.present { '✓' } else { '✗' }, need.name);
    };
    device.needs.iter().for_each(|need| tell(need, ""));
    for need in &device.wishes {
        let presets = presets_that_need(&need.name).join(", ");
        let asks = match Conservative::ALL.iter().find(|choice| choice.needs().contains(&need.name.as_str())) {
            Some(choice) if presets.is_empty() => format!(", for grid.conservative = {choice}"),
            Some(choice) => format!(", for grid.conservative = {choice}, as in the presets {presets}"),
            None => ", for rays.tracer = query".to_owned(),
        };
        tell(need, &asks);
    }
    text += &presets_text(device);
    text += "   limits:\n";
    for (key, words, value) in limits(device) {
        let value = match &value {
            Value::Array(counts) => counts.iter().map(Value::to_string).collect::<Vec<_>>().join(", "),
            bytes if key.ends_with("_bytes") => short_bytes(bytes.as_u64().unwrap_or(0)),
            _ if key.ends_with("_ns") => format!("{} ns", device.limits.timestamp_period),
            count => count.to_string(),
        };
        text += &format!("     {words:44} {value}\n");
    }
    text += "   memory:\n";
    for (heap, (bytes, local)) in device.heaps.iter().enumerate() {
        let budget = device.budgets.as_ref().map(|budgets| format!(", {} free", short_bytes(budgets[heap])));
        let whose = if *local { "the device's own" } else { "shared with it" };
        text += &format!("     heap {heap}: {}, {whose}{}\n", short_bytes(*bytes), budget.unwrap_or_default());
    }
    text
}

/// The presets whose settings need this feature.
fn presets_that_need(name: &str) -> Vec<&'static str> {
    let asks = |preset: &&Preset| (preset.settings)().grid.conservative.needs().contains(&name);
    PRESETS.iter().filter(asks).map(|preset| preset.name).collect()
}

/// For each preset, the requirements that the device does not meet.
fn lacks(device: &DeviceReport) -> impl Iterator<Item = (&'static str, Vec<String>)> {
    PRESETS.iter().map(|preset| (preset.name, renderer::lacks(device, &(preset.settings)())))
}

/// The presets that run, and the missing requirements of the others.
fn presets_text(device: &DeviceReport) -> String {
    let (run, others): (Vec<_>, Vec<_>) = lacks(device).partition(|(_, missing)| missing.is_empty());
    let names: Vec<&str> = run.iter().map(|(name, _)| *name).collect();
    let runs = if names.is_empty() { "none runs".to_owned() } else { format!("{} run", names.join(", ")) };
    let others = others.iter().map(|(name, missing)| format!("     {name} lacks {}\n", missing.join(", ")));
    format!("   presets:\n     {runs}\n{}", others.collect::<String>())
}

/// Relevant limits: key, description, and value in the unit at the key's end.
fn limits(device: &DeviceReport) -> [(&'static str, &'static str, Value); 13] {
    let limits = &device.limits;
    [
        ("storage_buffer_bytes", "storage buffer, at most", limits.max_storage_buffer_range.into()),
        ("allocation_bytes", "single allocation, at most", device.max_allocation_bytes.into()),
        ("image_side_2d", "side of a 2D image, at most", limits.max_image_dimension2_d.into()),
        ("image_side_3d", "side of a 3D image, at most", limits.max_image_dimension3_d.into()),
        ("image_layers", "layers of an image, at most", limits.max_image_array_layers.into()),
        ("framebuffer_layers", "layers of a framebuffer, at most", limits.max_framebuffer_layers.into()),
        ("color_attachments", "colour attachments, at most", limits.max_color_attachments.into()),
        (
            "stage_storage_buffers",
            "storage buffers of a shader stage, at most",
            limits.max_per_stage_descriptor_storage_buffers.into(),
        ),
        (
            "stage_storage_images",
            "storage images of a shader stage, at most",
            limits.max_per_stage_descriptor_storage_images.into(),
        ),
        ("push_descriptors", "push descriptors, at most", device.max_push_descriptors.into()),
        ("rgba32f_samples", "samples per pixel of an RGBA32F colour image", device.color_samples.clone().into()),
        ("d32f_samples", "samples per pixel of a D32F depth image", device.depth_samples.clone().into()),
        ("timestamp_period_ns", "timestamp period", limits.timestamp_period.into()),
    ]
}

fn json(devices: &[DeviceReport]) -> String {
    let list: Vec<_> = devices.iter().enumerate().map(|(index, device)| device_json(index, device)).collect();
    format!("{:#}\n", json!({ "version": 1, "devices": list }))
}

fn device_json(index: usize, device: &DeviceReport) -> Value {
    let (major, minor, patch) = device.api_version;
    let limits: serde_json::Map<_, _> =
        limits(device).into_iter().map(|(key, _, value)| (key.to_owned(), value)).collect();
    let needs: serde_json::Map<_, _> =
        device.needs.iter().map(|need| (need.name.clone(), Value::Bool(need.present))).collect();
    let heap = |(heap, (bytes, local)): (usize, &(u64, bool))| {
        let free = device.budgets.as_ref().map(|budgets| budgets[heap]);
        json!({ "bytes": bytes, "device_local": local, "free_bytes": free })
    };
    json!({
        "index": index,
        "name": device.name,
        "kind": device.kind.name(),
        "api_version": format!("{major}.{minor}.{patch}"),
        "driver": device.driver,
        "usable": device.needs.iter().all(|need| need.present),
        "needs": needs,
        "presets_lack": lacks(device).map(|(name, missing)| (name.to_owned(), json!(missing))).collect::<serde_json::Map<_, _>>(),
        "limits": limits,
        "heaps": device.heaps.iter().enumerate().map(heap).collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use twobounce::ash::vk::PhysicalDeviceLimits;
    use twobounce::vk::{DeviceKind, Need};

    fn device(present: bool) -> DeviceReport {
        let need = |name: &str, present| Need { name: name.into(), present };
        DeviceReport {
            name: "A device".into(),
            kind: DeviceKind::Integrated,
            api_version: (1, 3, 230),
            driver: "a driver 1.2".into(),
            needs: vec![need("dynamicRendering", present), need("scalarBlockLayout", true)],
            wishes: vec![need("geometryShader", present)],
            limits: PhysicalDeviceLimits {
                max_per_stage_descriptor_storage_buffers: 64,
                max_per_stage_descriptor_storage_images: if present { 64 } else { 6 },
                max_fragment_combined_output_resources: 64,
                ..Default::default()
            },
            max_allocation_bytes: 1 << 31,
            max_push_descriptors: 32,
            heaps: vec![(8 << 30, true), (16 << 30, false)],
            budgets: Some(vec![7 << 30, 3 << 20]),
            color_samples: vec![1, 4],
            depth_samples: vec![1, 2, 4],
        }
    }

    #[test]
    fn the_list_says_what_is_there_and_what_is_missing() {
        let text = text(&[device(true), device(false)]);
        for part in [
            "0: A device\n   integrated GPU, Vulkan 1.3.230, driver a driver 1.2\n   has everything",
            "✓ geometryShader, for grid.conservative = geometry-shader, as in the presets corrected-16, corrected, printed\n",
            "1: A device\n",
            "cannot be used, it lacks dynamicRendering:\n     ✗ dynamicRendering\n     ✓ scalarBlockLayout",
            "presets:\n     balanced, fast, accurate, cones, corrected-16, corrected, printed, lpv, lpv-printed, photons, paths, photons-printed, probes run\n   limits",
            "presets:\n     none runs\n     balanced lacks dynamicRendering\n",
            "     printed lacks dynamicRendering, geometryShader, maxPerStageDescriptorStorageImages 7\n",
            "heap 1: 16.00 GiB, shared with it, 3.0 MiB free",
            "single allocation, at most                   2.00 GiB",
        ] {
            assert!(text.contains(part), "{part:?} is not in\n{text}");
        }
    }

    #[test]
    fn the_json_says_the_same() {
        let list: Value = serde_json::from_str(&json(&[device(true), device(false)])).unwrap();
        assert_eq!(list["version"], 1);
        let [first, second] = [&list["devices"][0], &list["devices"][1]];
        assert_eq!((&first["usable"], &second["usable"]), (&json!(true), &json!(false)));
        assert_eq!(second["needs"]["dynamicRendering"], false);
        let lacks = |preset: &str| &second["presets_lack"][preset];
        assert_eq!(lacks("fast"), &json!(["dynamicRendering"]));
        assert_eq!(
            lacks("printed"),
            &json!(["dynamicRendering", "geometryShader", "maxPerStageDescriptorStorageImages 7"])
        );
        assert_eq!(
            first["heaps"][1],
            json!({ "bytes": 17179869184_u64, "device_local": false, "free_bytes": 3145728 })
        );
        assert_eq!(first["limits"]["rgba32f_samples"], json!([1, 4]));
    }
}
