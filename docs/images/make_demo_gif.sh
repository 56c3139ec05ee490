#!/bin/bash
# Writes demo.gif beside this file: what RViz shows of the shipped sequence, forth and back. Needs ImageMagick.
#   ./run demo --screenshots --output FOLDER && docs/images/make_demo_gif.sh FOLDER
set -euo pipefail

screenshots=$(realpath "$1")
cd "$(dirname "$0")"
composed=$(mktemp -d)
trap 'rm -r "$composed"' EXIT
# where RViz shows the scene and the camera's image on its screen of 1440x900
scene=954x808+470+62 camera=448x252+0+97
for screenshot in "$screenshots"/rviz_[0-9]*.png; do
  convert \( "$screenshot" -crop $scene +repage -resize 500x \) \( "$screenshot" -crop $camera +repage -resize 180x \) \
    -gravity southeast -composite "$composed/$(basename "$screenshot")"
done
# every second frame of a pass at 15 Hz; small changes of colour, the noise of the cloud, are left out
convert -delay 13 -loop 0 "$composed"/*.png $(printf "%s\n" "$composed"/*.png | sort -r | sed "1d;\$d") +dither -colors 64 -fuzz 5% -layers OptimizeTransparency demo.gif
