// SPDX-License-Identifier: Apache-2.0
#include "tests/common/video/exif_bytes.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(ExifFuzz, MutatedFilesNeverCrash) {
  const std::string jpeg = "\xff\xd8\xff\xda\xff\xd9";
  const std::string png = std::string("\x89PNG\r\n\x1a\n", 8) + std::string(25, '\0') + std::string(12, '\0');
  std::vector<std::string> corpus = {"", jpeg, png};
  for (const bool little_endian : {false, true}) {
    const std::string tiff = test::tiff_with_orientation(6, little_endian);
    corpus.push_back(test::jpeg_with_exif(jpeg, tiff));
    corpus.push_back(test::png_with_exif(png, tiff));
    corpus.push_back(test::jpeg_with_exif(jpeg, test::tiff_with_focal(26, little_endian)));
  }
  fuzz(corpus, 200'000);
}

}  // namespace
}  // namespace gyre
