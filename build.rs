fn main() {
    let _ = shaderc::Compiler::new().unwrap();
    println!("cargo:rerun-if-changed=glsl");
}
