// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/skeleton.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const KeypointLayout& layout() {
  static const KeypointLayout known = *keypoint_layout("133");
  return known;
}

// Somebody seen from the front, everything found.
Skeleton frontal_person() {
  Skeleton s;
  s.keypoints.assign(133, {{100, 100}, 0.1, 1});
  const auto put = [&](int i, double x, double y) { s.keypoints[i] = {{x, y}, 0.9, 1}; };
  put(5, 140, 120);  // the left shoulder is on the right of the picture
  put(6, 60, 120);
  put(7, 160, 180), put(8, 40, 180), put(9, 170, 230), put(10, 30, 230);
  put(11, 120, 250), put(12, 80, 250), put(13, 122, 340), put(14, 78, 340), put(15, 124, 430), put(16, 76, 430);
  for (int i = 0; i < 68; ++i) put(23 + i, 100, 60);
  const auto face = [&](int i, double x, double y) { put(23 + i, x, y); };
  for (int i = 0; i <= 16; ++i) face(i, 100 + 20 * (i - 8) / 8.0, 60 + 20 - std::abs(i - 8) * 2.0);
  face(30, 100, 65);
  face(36, 85, 58), face(39, 93, 58), face(42, 107, 58), face(45, 115, 58);
  face(37, 88, 56), face(38, 90, 56), face(40, 90, 60), face(41, 88, 60);
  face(43, 110, 56), face(44, 112, 56), face(46, 112, 60), face(47, 110, 60);
  face(48, 92, 75), face(54, 108, 75);
  return s;
}

const LandmarkGroup& group_with(const std::vector<LandmarkGroup>& groups, const std::string& name) {
  for (const LandmarkGroup& group : groups)
    for (const NamedKeypoint& point : group.points)
      if (point.name == name) return group;
  ADD_FAILURE() << name;
  return groups.front();
}

TEST(Skeleton, ChanceFindsAreNobody) {
  Skeleton s = frontal_person();
  EXPECT_TRUE(is_person(s, layout()));
  for (Keypoint& k : s.keypoints) k.confidence *= 0.5;  // best 0.45
  EXPECT_FALSE(is_person(s, layout()));
  s = frontal_person();
  for (const int i : {7, 8, 9, 10, 11, 12, 13, 14, 15, 16}) s.keypoints[i].confidence = 0.1;
  EXPECT_FALSE(is_person(s, layout()));  // one bone is left
}

TEST(Skeleton, TheFaceComesFromTheMostFrontalPicture) {
  Skeleton turned = frontal_person();
  for (const int i : {36, 39}) turned.keypoints[23 + i].pixel.x() += 8;  // the right eye has come closer to the nose
  turned.view = 1;
  const auto groups = choose_views({turned, frontal_person()}, layout(), 1);
  EXPECT_EQ(group_with(groups, "leftEyeInner").skeletons, std::vector<int>{1});
}

TEST(Skeleton, HandsComeFromTheSideTheyAreOn) {
  Skeleton from_left = frontal_person(), from_right = frontal_person(), front = frontal_person();
  for (Skeleton* s : {&from_left, &from_right}) {
    s->keypoints[5].pixel.x() = 103;
    s->keypoints[6].pixel.x() = 97;
  }
  for (int i = 0; i < 21; ++i) {
    from_left.keypoints[91 + i].confidence = 0.8;
    from_right.keypoints[112 + i].confidence = 0.8;
    front.keypoints[91 + i].confidence = front.keypoints[112 + i].confidence = 0.8;
  }
  from_left.keypoints[3].confidence = 0.8;
  from_right.keypoints[4].confidence = 0.8;
  const auto groups = choose_views({front, from_right, from_left}, layout(), 1);
  EXPECT_EQ(group_with(groups, "leftFingertip").skeletons, std::vector<int>{2});
  EXPECT_EQ(group_with(groups, "rightFingertip").skeletons, std::vector<int>{1});
}

TEST(Skeleton, HeelsComeFromBehind) {
  Skeleton behind = frontal_person(), swapped = frontal_person(), front = frontal_person();
  const auto feet = [](Skeleton& s, double left_x, double right_x, double toe_y) {
    s.keypoints[19] = {{left_x, 450}, 0.9, 1};
    s.keypoints[22] = {{right_x, 450}, 0.9, 1};
    s.keypoints[17] = {{left_x, toe_y}, 0.9, 1};
    s.keypoints[20] = {{right_x, toe_y}, 0.9, 1};
  };
  feet(behind, 80, 120, 440);
  feet(swapped, 120, 80, 440);  // left and right taken for each other
  feet(front, 80, 120, 460);    // toes below the heels: seen from the front
  const auto groups = choose_views({swapped, front, behind}, layout(), 3);
  EXPECT_EQ(group_with(groups, "leftHeel").skeletons, std::vector<int>{2});
}

TEST(KeypointLayout, BothLayoutsAreWhole) {
  for (const char* name : {"133", "135"}) {
    const auto known = keypoint_layout(name);
    ASSERT_TRUE(known);
    EXPECT_EQ(std::to_string(known->count), name);
    for (int side = 0; side < 2; ++side) EXPECT_LE(known->hand[side] + 21, known->count);
    EXPECT_LE(known->face + 68, known->count);
  }
  EXPECT_FALSE(keypoint_layout("17"));
}

}  // namespace
}  // namespace gyre
