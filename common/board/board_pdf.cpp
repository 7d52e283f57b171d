// SPDX-License-Identifier: Apache-2.0
#include "common/board/board_pdf.h"

#include "common/board/board.h"

#include <fmt/format.h>

namespace gyre {

namespace {

constexpr double points_per_metre = 72 / 0.0254;
// Millimetres below the board.
constexpr double ruler_below = 7;
constexpr double text_below = 16;
constexpr double line_height = 4.2;
constexpr double text_size = 3.2;
constexpr int ruler_length = 150;
constexpr double line_width = 0.2;

// Puts the drawing's commands together; lengths in millimetres from the page's top left.
class Drawing {
 public:
  explicit Drawing(double page_height) : page_height_(page_height) {}

  void rectangle(double x, double y, double width, double height) {
    commands_ += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re\n", x, page_height_ - y - height, width, height);
  }
  // One area for everything, so that readers draw no seams between rectangles that touch.
  void fill() { commands_ += "f\n"; }
  // `text` without parentheses and backslashes; y: its base line.
  void text(double x, double y, const std::string& text) {
    commands_ += fmt::format("BT /F1 {} Tf {:.4f} {:.4f} Td ({}) Tj ET\n", text_size, x, page_height_ - y, text);
  }
  const std::string& commands() const { return commands_; }

 private:
  double page_height_;
  std::string commands_ = fmt::format("{0:.8f} 0 0 {0:.8f} 0 0 cm\n", points_per_metre / 1000);
};

std::string draw_page(const Eigen::Vector2d& page_mm, const std::string& paper) {
  Drawing drawing(page_mm.y());
  const double left = 0.5 * (page_mm.x() - 1000 * board_width);
  const double rest = page_mm.y() - 1000 * board_height;
  const double top = std::min(15.0, 0.25 * rest);
  for (const BoardRectangle& r : black_rectangles())
    drawing.rectangle(left + 1000 * r.top_left.x(), top + 1000 * r.top_left.y(), 1000 * r.size.x(), 1000 * r.size.y());
  const double below = top + 1000 * board_height;
  const double ruler = below + ruler_below;
  drawing.rectangle(left, ruler, ruler_length, line_width);
  // The outer edges of the first and the last mark are the ruler's length apart.
  for (int mark = 0; mark <= ruler_length; mark += 10) {
    const double shift = line_width * mark / ruler_length;
    drawing.rectangle(left + mark - shift, ruler - (mark % 50 == 0 ? 3 : 1.5), line_width, mark % 50 == 0 ? 3 : 1.5);
  }
  drawing.fill();
  for (int mark = 0; mark <= ruler_length; mark += 50)
    drawing.text(left + mark + (mark == 0 ? 0 : -3), ruler + 1.2 + text_size, fmt::format("{}", mark));
  drawing.text(left + ruler_length + 6, ruler + 1.2 + text_size, "mm");
  drawing.text(
      left, below + text_below,
      fmt::format("Gyre board {}, {}: {} x {} squares of {:.0f} mm. Print at 100 %, not fitted to the page; the "
                  "ruler must be {} mm long.",
                  board_version, paper, board_columns, board_rows, 1000 * board_square, ruler_length));
  drawing.text(
      left, below + text_below + line_height,
      "Lay it flat on the floor beside the subject's feet, in sight of the camera from many sides, and leave it "
      "there.");
  return drawing.commands();
}

}  // namespace

Eigen::Vector2d size_of(Paper paper) {
  return paper == Paper::a4 ? Eigen::Vector2d(0.210, 0.297) : Eigen::Vector2d(0.2159, 0.2794);
}

std::string board_pdf(Paper paper) {
  const Eigen::Vector2d points = points_per_metre * size_of(paper);
  const std::string page = draw_page(1000 * size_of(paper), paper == Paper::a4 ? "A4" : "US letter");
  const std::array<std::string, 6> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 4 0 R "
                  "/Resources << /Font << /F1 5 0 R >> >> >>",
                  points.x(), points.y()),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", page.size(), page),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>",
      fmt::format("<< /Title (Gyre board {}) /Producer (Gyre {}) >>", board_version, GYRE_VERSION)};
  std::string pdf = "%PDF-1.4\n";
  // An entry of the table has 20 bytes with its line end.
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += fmt::format("{:010} 00000 n \n", pdf.size());
    pdf += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t start = pdf.size();
  return pdf + table +
         fmt::format("trailer\n<< /Size {} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{}\n%%EOF\n", objects.size() + 1,
                     start);
}

}  // namespace gyre
