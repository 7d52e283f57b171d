// SPDX-License-Identifier: Apache-2.0
// Writes small ONNX networks, so that the reader of networks is tested without any trained weight.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace gyre {

// One output of the network: constant values in the given shape.
struct ConstantOutput {
  std::string name;
  std::vector<std::int64_t> shape;
  std::vector<float> values;
};

// A network with an image input (1, 3, height, width) whose outputs do not depend on what is in the image: the image's
// mean, times 0, plus the values.
void write_constant_network(const std::filesystem::path& file, int width, int height,
                            const std::vector<ConstantOutput>& outputs);

// A network whose heat maps (1, keypoints, height, width) are a 1x1 convolution of the image: weights[k] of the three
// channels and a bias.
struct ColourFilter {
  float weights[3];
  float bias;
};
void write_colour_network(const std::filesystem::path& file, int width, int height,
                          const std::vector<ColourFilter>& filters);

}  // namespace gyre
