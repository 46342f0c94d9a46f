#version 460
// Pass 1, record: does nothing; colour writes are masked too.
void main() {
}
