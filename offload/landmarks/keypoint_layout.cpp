// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/keypoint_layout.h"

namespace gyre {

Result<KeypointLayout> keypoint_layout(const std::string& name) {
  KeypointLayout layout;
  if (name == "133") {
    layout.count = 133;
    layout.shoulder = {5, 6};
    layout.ear = {3, 4};
    layout.heel = {19, 22};
    layout.toe = {17, 20};
    layout.face = 23;
    layout.hand = {91, 112};
    layout.bones = {{5, 6},   {5, 7},   {7, 9},   {6, 8},   {8, 10},  {5, 11}, {6, 12},
                    {11, 12}, {11, 13}, {13, 15}, {12, 14}, {14, 16}, {0, 5},  {0, 6}};
  } else if (name == "135") {
    layout.count = 135;
    layout.shoulder = {5, 2};
    layout.ear = {18, 17};
    layout.heel = {21, 24};
    layout.toe = {19, 22};
    layout.hand = {25, 46};
    layout.face = 67;
    layout.bones = {{1, 2}, {2, 3},  {3, 4},   {1, 5},  {5, 6},   {6, 7},   {1, 8},
                    {8, 9}, {9, 10}, {10, 11}, {8, 12}, {12, 13}, {13, 14}, {0, 1}};
  } else {
    return wrong_use("unknown layout of keypoints", name, "give 133 or 135");
  }
  return layout;
}

}  // namespace gyre
