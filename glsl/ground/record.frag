#version 460
// Record: does nothing; colour writes are also masked.
void main() {
}
