// SPDX-License-Identifier: Apache-2.0
// Pipeline stage `cameras`: keyframes in, cameras and sparse points in the world out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// In: scan.json, frames/. Out: cameras.txt, images.txt, points3D.txt (COLMAP text, image names as in frames/) and
// scene.json, which says what the scale rests on and how well, and whether the cameras stand all around ("ring"). Tells
// by itself whether the camera walks around or the subject turns before a fixed one ("motion" in both results: "orbit"
// or "turn"); of a turn only what turns with the subject is used. Options: height_mm, the subject's stature (0: as in
// scan.json, else 1700 is assumed); turntable_radius_mm, from the axis to the camera (0: not known); max_features per
// picture. A printed board (common/board) that is seen goes before both. Errors: fewer than three pictures, pictures of
// mixed size in a pass, no texture, no consistent model.
Stage cameras_stage();

}  // namespace gyre
