#version 460
// Pass 5's depth, laid down first where nothing may be discarded: hidden surfaces then trace no cones.
void main() {
}
