"""Makes the files of this folder with OpenEXR's own library: pip install OpenEXR numpy; python make.py"""

import numpy as np
import OpenEXR

WIDTH, HEIGHT = 12, 40
y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
LUMINANCE, RY, BY = 0.5 + 0.25 * x + 0.125 * (y % 3), 0.0625 * x - 0.03125 * y, 0.03125 * y - 0.0625 * x


def write(name, compression, dtype, sampling):
    def chroma(plane):
        # The binding asks for an array of full size, and looks for all samples at its start.
        stored = np.zeros((HEIGHT, WIDTH), dtype)
        samples = plane[::sampling, ::sampling]
        stored.flat[: samples.size] = samples
        return OpenEXR.Channel(stored, sampling, sampling)

    header = {"compression": compression, "type": OpenEXR.scanlineimage}
    channels = {"Y": OpenEXR.Channel(LUMINANCE.astype(dtype), 1, 1), "RY": chroma(RY), "BY": chroma(BY)}
    OpenEXR.File(header, channels).write(name + ".exr")


for name in ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "B44", "PXR24", "DWAA"):
    write("chroma-" + name.lower(), getattr(OpenEXR, name + "_COMPRESSION"), np.float16, 2)
write("chroma-piz-float", OpenEXR.PIZ_COMPRESSION, np.float32, 2)
write("chroma-full", OpenEXR.ZIP_COMPRESSION, np.float32, 1)
