//! A machine without a Vulkan loader, without a driver or without the requested device: one message that names what is
//! missing, and exit code 2.
#![cfg(target_os = "linux")]

use std::process::{Command, Output};

fn info(variables: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.arg("info").envs(variables.iter().copied());
    command.output().unwrap()
}

fn assert_refused(output: &Output, package: &str) {
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(output.stdout.is_empty());
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.contains(package), "{message}");
}

#[test]
fn no_loader_names_its_package() {
    // An empty file in place of the library, found before the real one.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("libvulkan.so.1"), "").unwrap();
    assert_refused(&info(&[("LD_LIBRARY_PATH", folder.path().to_str().unwrap())]), "libvulkan1");
}

#[test]
fn no_driver_names_its_package() {
    let nowhere = "/nonexistent/driver.json";
    assert_refused(&info(&[("VK_DRIVER_FILES", nowhere), ("VK_ICD_FILENAMES", nowhere)]), "mesa-vulkan-drivers");
}

#[test]
fn with_both_the_devices_are_listed() {
    let output = info(&[]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.starts_with("0: ") && text.contains("geometryShader"), "{text}");
}

/// Asks for a missing device by the variable, by the flag, and by the flag against the variable.
#[test]
fn a_device_that_is_not_there_is_refused_with_a_list() {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("image.png");
    let cases: [(Option<&str>, &[&str]); 3] =
        [(Some("Voodoo"), &[]), (None, &["--device", "Voodoo"]), (Some("0"), &["--device", "Voodoo"])];
    for (variable, flags) in cases {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
        command.args(["render", "assets/cornell-point.glb", "--size", "8x8", "-o"]).arg(&image).args(flags);
        command.env_remove("TWOBOUNCE_DEVICE").envs(variable.map(|name| ("TWOBOUNCE_DEVICE", name)));
        let output = command.output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("\"Voodoo\"") && message.contains("0: "), "{message}");
        assert!(!image.exists());
    }
}
