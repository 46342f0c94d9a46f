#version 460
// Record: does nothing; colour writes are masked too.
void main() {
}
