const float PI = 3.14159265358979;
const float GOLDEN_ANGLE = 2.39996323; // between successive seeds of a sunflower
