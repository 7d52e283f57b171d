// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(ConfigFuzz, MutatedFilesNeverCrash) {
  fuzz({"", "name = \"rig\"\n[run]\nheight-mm = 1660.5\n", "name = [1, 2]\n[run.deep]\nx = 1979-05-27T07:32:00Z\n",
        "name = '''a\nb'''\n", "[[run]]\n", "# größer\nname = \"Zoë\"\n"},
       10'000);
}

}  // namespace
}  // namespace gyre
