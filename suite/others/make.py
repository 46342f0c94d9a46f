"""Makes the images of other programs and the list of them: python make.py --device TEXT [--scenes NAME ...]

Every scene that `scenes.read` reads is rendered by Mitsuba and by Cycles: along few paths a pixel at both sizes, and
along many at the smaller one, to see whether the programs agree. The images go into out/suite/others, the list into
suite/others.toml.
"""

import argparse
import subprocess
import sys

from scenes import SUITE

FEW, MANY = 16, 256
PROGRAMS = {
    "Mitsuba 3.9.1": ("mitsuba_rows.py", "scalar_rgb, integrator path"),
    "Cycles 4.5.15": ("cycles_rows.py", "Blender's bpy, CPU, no denoiser"),
}
SCENES = ["cornell-area", "cornell-point", "thick-walls", "two-rooms", "stairs", "corridor"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--device", required=True, help="where the times are measured")
    parser.add_argument("--scenes", nargs="*", default=SCENES)
    args = parser.parse_args()
    folder = SUITE.parent / "out/suite/others"
    folder.mkdir(parents=True, exist_ok=True)
    text = "# Images of other programs, written by suite/others/make.py: `twobounce suite --imports suite/others.toml -o suite`\n"
    for scene in args.scenes:
        for program, (script, how) in PROGRAMS.items():
            for paths, side in [(FEW, 256), (FEW, 128), (MANY, 128)]:
                image = folder / f"{scene}-{script.split('_')[0]}-{paths}-{side}.exr"
                command = [sys.executable, SUITE / "others" / script, scene, str(side), str(paths), image]
                said = subprocess.run(command, check=True, capture_output=True, text=True)
                milliseconds = (said.stderr if "cycles" in script else said.stdout).split()[-1]
                text += (
                    f'\n[[import]]\nname = "{program}, {paths} paths a pixel"\nscene = "{scene}"\n'
                    f'image = "../out/suite/others/{image.name}"\nmilliseconds = {milliseconds}\n'
                    f'device = "{args.device}"\nnote = "{how}: suite/others/{script}"\ndirect = "exact"\n'
                )
                print(scene, program, paths, side, milliseconds, flush=True)
    (SUITE / "others.toml").write_text(text)


main()
