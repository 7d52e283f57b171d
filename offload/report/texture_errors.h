// SPDX-License-Identifier: Apache-2.0
// How visible the seams of a texture are, and how sharp it is against the photographs.
#pragma once

#include "common/mesh/mesh.h"

#include <opencv2/core/mat.hpp>

namespace gyre {

// Mean colour differences (norm over BGR, encoded levels) of neighbouring texels.
struct SeamEnergy {
  double border = 0.0;    // between texels of different photographs
  double interior = 0.0;  // between texels of one photograph
  double charts = 0.0;    // between the two places in the texture that a point on a border of charts has

  double ratio() const { return interior > 0.0 ? border / interior : 0.0; }
};

// albedo: 8-bit BGR. view: 16-bit, as large, 1 + the photograph of each texel, 0 for none. Texels next to each other
// in the picture count as neighbours.
SeamEnergy seam_energy(const cv::Mat& albedo, const cv::Mat& view, const TriangleMesh& mesh);

// Mean absolute Laplacian of the grey picture where `mask` (8-bit) is not zero at least 6 pixels around, after a blur
// of 0.8 pixels, which takes sensor noise away. 0 where the mask leaves nothing.
double sharpness(const cv::Mat& image, const cv::Mat& mask);

// Peak signal-to-noise ratio in dB and structural similarity (Wang et al., IEEE TIP 2004: Gaussian window of 1.5
// pixels, on grey) of two 8-bit BGR pictures inside a mask.
struct PictureSimilarity {
  double psnr = 0.0;
  double ssim = 0.0;
};
PictureSimilarity picture_similarity(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask);

}  // namespace gyre
