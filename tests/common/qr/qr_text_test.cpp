// SPDX-License-Identifier: Apache-2.0
#include "common/qr/qr_text.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// Columns of a line without its colours: half blocks back to the rows they show.
void add_rows(std::string_view line, std::vector<std::vector<bool>>& rows) {
  std::vector<bool> upper;
  std::vector<bool> lower;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == '\033') {
      i = line.find('m', i) + 1;
      continue;
    }
    const std::string_view rest = line.substr(i);
    const bool full = rest.starts_with("█");
    upper.push_back(full || rest.starts_with("▀"));
    lower.push_back(full || rest.starts_with("▄"));
    i += rest[0] == ' ' ? 1 : 3;
  }
  rows.push_back(upper);
  rows.push_back(lower);
}

TEST(QrText, ShowsTheModulesWithAQuietZone) {
  const std::vector<std::vector<bool>> modules = qr_modules("tcp://192.168.100.200:7411 K7QF-2M9X");
  const std::size_t side = modules.size();
  ASSERT_EQ((side - 8 - 17) % 4, 0U);  // a QR code of version v has 17 + 4 v modules a side
  for (std::size_t i = 0; i < side; ++i) {
    ASSERT_EQ(modules[i].size(), side);
    for (std::size_t j = 0; j < 4; ++j) {
      EXPECT_FALSE(modules[i][j] || modules[j][i] || modules[i][side - 1 - j] || modules[side - 1 - j][i]);
    }
  }
  // The three position marks: a dark ring of seven modules with three by three in the middle.
  for (const auto& [y, x] : {std::pair{4UL, 4UL}, {4UL, side - 11}, {side - 11, 4UL}}) {
    for (std::size_t i = 0; i < 7; ++i) {
      for (std::size_t j = 0; j < 7; ++j) {
        const std::size_t ring = std::min({i, j, 6 - i, 6 - j});
        EXPECT_EQ(modules[y + i][x + j], ring != 1);
      }
    }
  }
  const std::string text = qr_text(modules);
  std::vector<std::vector<bool>> shown;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    add_rows(std::string_view(text).substr(begin, end - begin), shown);
    begin = end + 1;
  }
  shown.resize(side);
  EXPECT_EQ(shown, modules);
}

}  // namespace
}  // namespace gyre
