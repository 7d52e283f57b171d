// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/atomic_file.h"
#include "offload/body/template.h"
#include "tests/fuzz/fuzz.h"
#include "tests/offload/avatar/small_template.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace gyre {
namespace {

TEST(TemplateFuzz, MutatedFilesNeverCrash) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("fuzz-" + std::to_string(::getpid()) + ".glb");
  ASSERT_TRUE(write_template(small_template(), file));
  const std::string whole = read_file(file).value();
  std::filesystem::remove(file);
  ASSERT_LE(whole.size(), 65536U);
  // Without its checksum a mutant gets past the first look.
  std::string unsealed = whole;
  unsealed.replace(unsealed.find("\"checksum\""), 10, "\"unsealed\"");
  fuzz({"", whole, unsealed}, 4'000);
}

}  // namespace
}  // namespace gyre
