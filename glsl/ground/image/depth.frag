#version 460
// Depth, laid down first where nothing may be discarded: hidden surfaces then look up nothing.
void main() {
}
