// SPDX-License-Identifier: Apache-2.0
// The form of a template file, shared by its reader and its writer.
//
// A template is a plain GLB that any viewer opens: one mesh of one primitive with skin (JOINTS_0, WEIGHTS_0), texture
// coordinates (TEXCOORD_0) and expressions as morph targets (names in the mesh's extras.targetNames). What glTF has no
// words for is in the mesh's extras.gyre_template:
//
//   version         2
//   name, notices   what it is, and the licences of what it was made from
//   joints          one a joint of the skin, in its order, parents first: {name, parent, vertices, weights}; its rest
//                   position is the weighted sum of the vertices. Optional axes (9 numbers, columns), least, most:
//                   JointRange
//   components      [{name, role, ...}]: role "body" or "head"; offsets either as "target", the name of a morph target,
//                   or packed: "view" of signed integers of "bits" (8 or 16), "step" metres each, three a vertex, of
//                   the vertices that the view "vertices" lists (u32; missing: all). standard_deviation (default 1):
//                   the weight of the offsets that is one standard deviation among people
//   landmarks       {name: vertex}
//   shape_means     optional {"female": [...], "male": [...]}: coefficients of the body components
//   parts           optional [{name, vertices, triangles}] in the order of the arrays, "body" first; missing: all is
//   body regions         optional view of u8, one a vertex, into region_names; missing: by the joint that moves a
//   vertex most mirror          optional view of u32, one a vertex, 0xFFFFFFFF: none; missing: by position
//   seam_vertices   optional view of u32: which vertex each of the primitive's last vertices is a copy of; missing:
//                   vertices at the same place are one
//   checksum        optional: SHA-256 of the buffer followed by extras.gyre_template without this entry (compact JSON
//   with
//                   sorted keys)
//
// Positions are metres, +Y up, facing +Z, soles on y = 0, arms down: an A-pose.
#pragma once

#include "common/bundle/sha256.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string>

namespace gyre {

constexpr int template_format_version = 2;

constexpr std::array<const char*, 12> region_names = {"torso",     "head",      "face",       "left_arm",
                                                      "right_arm", "left_hand", "right_hand", "left_leg",
                                                      "right_leg", "left_foot", "right_foot", "inner"};

inline std::string template_content_checksum(const std::string& buffer, nlohmann::json extras) {
  extras.erase("checksum");
  return sha256(std::string_view(buffer + extras.dump()));
}

}  // namespace gyre
