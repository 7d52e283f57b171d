// SPDX-License-Identifier: Apache-2.0
#include "common/board/board_pdf.h"

#include "common/board/board.h"
#include "common/board/find_board.h"
#include "tests/common/board/board_picture.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin) + begin.size();
  return text.substr(from, text.find(end, from) - from);
}

// What the page fills with black, metres from its top left.
std::vector<BoardRectangle> filled(const std::string& pdf, Paper paper) {
  std::istringstream commands(between(pdf, "stream\n", "endstream"));
  std::vector<BoardRectangle> rectangles;
  double unit = 0;  // metres
  for (std::string line; std::getline(commands, line);) {
    std::istringstream words(line);
    double x = 0, y = 0, width = 0, height = 0;
    if (line.ends_with(" cm")) {
      words >> unit;
      unit *= 0.0254 / 72;
    } else if (line.ends_with(" re") && words >> x >> y >> width >> height) {
      rectangles.push_back(
          {unit * Eigen::Vector2d(x, size_of(paper).y() / unit - y - height), unit * Eigen::Vector2d(width, height)});
    }
  }
  return rectangles;
}

class BoardPdf : public testing::TestWithParam<Paper> {};

TEST_P(BoardPdf, is_well_formed) {
  const std::string pdf = board_pdf(GetParam());
  EXPECT_TRUE(pdf.starts_with("%PDF-1.4\n"));
  EXPECT_TRUE(pdf.ends_with("\n%%EOF\n"));
  const std::size_t table = std::stoul(between(pdf, "startxref\n", "\n"));
  ASSERT_EQ(pdf.substr(table, 5), "xref\n");
  std::istringstream lines(pdf.substr(table + 5));
  int first = -1;
  std::size_t count = 0;
  lines >> first >> count;
  EXPECT_EQ(first, 0);
  EXPECT_EQ(between(pdf, "/Size ", " "), std::to_string(count));
  const std::size_t entries = pdf.find('\n', table + 5) + 1;
  for (std::size_t i = 1; i < count; ++i) {
    const std::string entry = pdf.substr(entries + 20 * i, 20);
    EXPECT_TRUE(entry.ends_with(" 00000 n \n")) << entry;
    const std::string object = std::to_string(i) + " 0 obj\n";
    EXPECT_EQ(pdf.substr(std::stoul(entry.substr(0, 10)), object.size()), object);
  }
  EXPECT_EQ(pdf.substr(entries + 20 * count, 8), "trailer\n");
  EXPECT_EQ(between(pdf, "stream\n", "endstream").size(), std::stoul(between(pdf, "/Length ", " ")));
  std::istringstream box(between(pdf, "/MediaBox [0 0 ", "]"));
  Eigen::Vector2d points;
  box >> points.x() >> points.y();
  EXPECT_LT((points * 0.0254 / 72 - size_of(GetParam())).norm(), 1e-7);
}

TEST_P(BoardPdf, carries_the_board_and_a_ruler_in_true_lengths) {
  const std::string pdf = board_pdf(GetParam());
  EXPECT_NE(pdf.find("Gyre board 1, "), std::string::npos);
  EXPECT_NE(pdf.find("3 x 4 squares of 60 mm"), std::string::npos);
  const std::vector<BoardRectangle> black = filled(pdf, GetParam());
  const std::vector<BoardRectangle> board = black_rectangles();
  ASSERT_GT(black.size(), board.size());
  const Eigen::Vector2d origin = black[0].top_left - board[0].top_left;
  for (std::size_t i = 0; i < board.size(); ++i) {
    EXPECT_LT((black[i].top_left - board[i].top_left - origin).norm(), 2e-7);
    EXPECT_LT((black[i].size - board[i].size).norm(), 2e-7);
  }
  Eigen::AlignedBox2d ruler;
  for (std::size_t i = board.size(); i < black.size(); ++i) {
    ruler.extend(black[i].top_left);
    ruler.extend(black[i].top_left + black[i].size);
  }
  EXPECT_NEAR(ruler.sizes().x(), 0.150, 1e-6);
  // Printers leave a margin of 6.4 mm at most.
  for (const BoardRectangle& r : black) {
    EXPECT_GT(r.top_left.minCoeff(), 0.0064);
    EXPECT_GT((size_of(GetParam()) - r.top_left - r.size).minCoeff(), 0.0064);
  }
}

TEST_P(BoardPdf, is_found_in_its_own_page) {
  constexpr double scale = 20000;  // every edge lies between two pixels
  const std::vector<BoardRectangle> black = filled(board_pdf(GetParam()), GetParam());
  const auto found = find_board(draw_sheet(black, size_of(GetParam()), scale));
  ASSERT_EQ(found.size(), static_cast<std::size_t>(board_corner_count));
  for (const BoardCorner& corner : found) {
    const Eigen::Vector2d place = corner.pixel / scale - black[0].top_left;
    EXPECT_LT((place - board_corner(corner.corner)).norm(), 0.1e-3) << corner.corner;
  }
}

INSTANTIATE_TEST_SUITE_P(Papers, BoardPdf, testing::Values(Paper::a4, Paper::letter));

TEST(Board, rectangles_do_not_overlap_and_lie_on_the_board) {
  const std::vector<BoardRectangle> all = black_rectangles();
  double area = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Eigen::AlignedBox2d box(all[i].top_left, all[i].top_left + all[i].size);
    EXPECT_TRUE(
        Eigen::AlignedBox2d(Eigen::Vector2d(-1e-9, -1e-9), Eigen::Vector2d(0.18 + 1e-9, 0.24 + 1e-9)).contains(box));
    area += all[i].size.prod();
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      const auto common =
          box.intersection(Eigen::AlignedBox2d(all[j].top_left, all[j].top_left + all[j].size)).sizes().eval();
      EXPECT_LE(common.minCoeff(), 1e-9);
    }
  }
  EXPECT_GT(area, 6 * board_square * board_square);
  EXPECT_EQ(board_markers().size(), 6u);
}

}  // namespace
}  // namespace gyre
