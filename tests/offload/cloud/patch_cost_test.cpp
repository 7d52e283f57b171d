// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_cost.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <random>

namespace gyre {
namespace {

ImageLevel random_level(std::uint64_t seed, double gain, double offset) {
  std::mt19937_64 random(seed);
  cv::Mat grey(40, 50, CV_8UC1);
  ImageLevel level;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      grey.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(gain * static_cast<double>(random() % 200) + offset);
    }
  }
  level.image = make_quad_image(grey);
  level.colours.assign(grey.total(), Rgb(9, 9, 9));
  return level;
}

PatchMapping shifted(float x, float y) {
  return {{x, y, 1}, {1, 0, 0}, {0, 1, 0}};
}

const PatchOptions options;
const PatchWeights weights(options);

TEST(PatchCost, SamePatchCostsNothingWhateverGainAndOffset) {
  const ReferencePatch patch = weights.reference_patch(random_level(1, 1.0, 0), 20, 20);
  EXPECT_NEAR(matching_cost(patch, shifted(20, 20), random_level(1, 1.0, 0).image, 1.0F), 0.0F, 1e-3F);
  EXPECT_NEAR(matching_cost(patch, shifted(20, 20), random_level(1, 0.5, 60).image, 0.0F), 0.0F, 1e-3F);
}

TEST(PatchCost, UnrelatedPatchCostsAboutOne) {
  const ReferencePatch patch = weights.reference_patch(random_level(1, 1.0, 0), 20, 20);
  float sum = 0;
  for (int seed = 2; seed < 42; ++seed)
    sum += matching_cost(patch, shifted(20, 20), random_level(seed, 1, 0).image, 1.0F);
  EXPECT_NEAR(sum / 40, 1.0F, 0.12F);
}

TEST(PatchCost, FlatPatchIsNoMatch) {
  ImageLevel flat;
  flat.image = make_quad_image(cv::Mat(40, 50, CV_8UC1, cv::Scalar(80)));
  flat.colours.assign(2000, Rgb(80, 80, 80));
  EXPECT_NEAR(matching_cost(weights.reference_patch(flat, 20, 20), shifted(20, 20), flat.image, 1.0F), 1.0F, 1e-5F);
}

TEST(PatchCost, HalfPixelIsTheMeanOfNeighbours) {
  const ImageLevel level = random_level(3, 1.0, 0);
  cv::Mat mean(40, 50, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 49; ++x) {
      mean.at<std::uint8_t>(y, x) =
          static_cast<std::uint8_t>((level.image.value(x, y) + level.image.value(x + 1, y)) / 2);
    }
  }
  ImageLevel averaged;
  averaged.image = make_quad_image(mean);
  averaged.colours = level.colours;
  const ReferencePatch patch = weights.reference_patch(averaged, 20, 20);
  EXPECT_LT(matching_cost(patch, shifted(20.5F, 20), level.image, 1.0F), 1e-3F);
  EXPECT_GT(matching_cost(patch, shifted(22.0F, 20), level.image, 1.0F), 0.3F);
}

TEST(PatchCost, OutsideOrBehindIsWorst) {
  const ImageLevel level = random_level(1, 1.0, 0);
  const ReferencePatch patch = weights.reference_patch(level, 20, 20);
  EXPECT_EQ(matching_cost(patch, shifted(-1, 20), level.image, 1.0F), worst_cost);
  EXPECT_EQ(matching_cost(patch, shifted(20, 40), level.image, 1.0F), worst_cost);
  EXPECT_EQ(matching_cost(patch, {{20, 20, -1}, {1, 0, 0}, {0, 1, 0}}, level.image, 1.0F), worst_cost);
}

TEST(PatchWeights, OtherColoursAndFarSamplesWeighLess) {
  ImageLevel level = random_level(1, 1.0, 0);
  for (std::size_t i = 0; i < level.colours.size(); ++i) {
    if (i % 50 >= 22) level.colours[i] = Rgb(200, 9, 9);
  }
  const ReferencePatch patch = weights.reference_patch(level, 20, 20);
  float sum = 0;
  for (int i = 0; i < patch_samples; ++i) {
    sum += patch.weight[i];
    if (patch_pattern.dx[i] >= 2) {
      EXPECT_LT(patch.weight[i], 1e-4F);
    } else {
      EXPECT_GT(patch.weight[i], 1e-3F);
    }
  }
  EXPECT_NEAR(sum, 1.0F, 1e-5F);
}

}  // namespace
}  // namespace gyre
