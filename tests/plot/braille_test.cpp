// Drawings in the terminal: dots, dashes, frames, the same text every time.
#include "plot/braille.hpp"

#include <unistd.h>

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>

#include "base/text.hpp"

namespace pendula::braille_test {

using namespace pendula::plot;

namespace {

std::vector<std::string> lines_of(const std::string& drawing) {
  std::vector<std::string> out;
  std::istringstream in(drawing);
  for (std::string line; std::getline(in, line);) out.push_back(line);
  return out;
}

Figure waves(int count, Eigen::Index points = 400) {
  Figure f;
  const Vec t = Vec::LinSpaced(points, 0, 10);
  for (int k = 0; k < count; ++k)
    f.series.push_back(
        {"wave " + std::to_string(k), t, (t.array() - 0.3 * k).sin().matrix(), {}, Style::line});
  return f;
}

Figure ball() {
  Figure f;
  f.three_d = f.equal = true;
  f.surfaces.push_back(sphere(1, {0, 0, 0}));
  const Vec t = Vec::LinSpaced(500, 0, 6.28);
  f.series.push_back(
      {"p", t.array().cos(), t.array().sin(), (0.3 * (3 * t.array()).sin()).matrix(), Style::line});
  return f;
}

}  // namespace

TEST_CASE("canvas: the dots of known lines") {
  Canvas canvas(3, 2);  // 6 × 8 dots
  const Clip all{0, 0, 5, 7};
  Pen pen;
  canvas.line(0, 0, 5, 0, pen, all);  // the top row
  canvas.line(0, 4, 3, 7, pen, all);  // a diagonal in the second row of cells
  CHECK(canvas.str(Palette::none) == "⠉⠉⠉\n⠑⢄\n");
}

TEST_CASE("canvas: lines are cut at the clip, wherever they begin") {
  Canvas whole(10, 5), far(10, 5);
  const Clip all{0, 0, 19, 19};
  Pen a, b;
  whole.line(-10, 10, 30, 10, a, all);
  far.line(-1e9, 10, 1e9, 10, b, all);
  CHECK(whole.str(Palette::none) == far.str(Palette::none));
  Pen c;
  whole.line(-5, -5, 100, -1, c, all);  // outside altogether
  CHECK(whole.str(Palette::none) == far.str(Palette::none));
}

TEST_CASE("canvas: dashes run on through a polyline") {
  Canvas one(10, 1), many(10, 1);
  const Clip all{0, 0, 19, 3};
  Pen a{ink, {3, 2}}, b{ink, {3, 2}};
  one.line(0, 0, 19, 0, a, all);
  for (int x = 0; x < 19; ++x) many.line(x, 0, x + 1, 0, b, all);
  CHECK(one.str(Palette::none) == many.str(Palette::none));
}

TEST_CASE(
    "canvas: characters keep their combining marks, broken UTF-8 and control characters become blanks") {
  CHECK(characters("ẋx\u0307") == std::vector<std::string>{"ẋ", "x\u0307"});
  CHECK(characters("a\n\x1b\xff\xe2\x82") == std::vector<std::string>{"a", " ", " ", " ", " "});
  CHECK(shortened("abcdef", 4) == "abc…");
  CHECK(shortened("abc", 4) == "abc");
}

TEST_CASE("drawing: a small figure, dot by dot") {
  Figure f;
  f.series.push_back({"y", Vec::LinSpaced(2, 0, 1), Vec::LinSpaced(2, 0, 1), {}, Style::line});
  f.axes[0].label = "x";
  f.axes[1].limits = Range{0, 1};
  // 48 × 24 dots: the line rises one dot every two, the same four cells again and again.
  const std::string expected =
      "y\n"
      "    ┌────────────────────────┐\n"
      "1.0 ┤                    ⣀⠤⠒⠉│\n"
      "    │                ⣀⠤⠒⠉    │\n"
      "    │            ⣀⠤⠒⠉        │\n"
      "0.5 ┤        ⣀⠤⠒⠉            │\n"
      "    │    ⣀⠤⠒⠉                │\n"
      "0.0 ┤⣀⠤⠒⠉                    │\n"
      "    └┬───────────┬──────────┬┘\n"
      "    0.0         0.5        1.0\n"
      "                x\n";
  CHECK(draw(checked(f), {30, 14, Palette::none}) == expected);
}

TEST_CASE("drawing: deterministic, at most as wide as asked, without escapes unless there are colours") {
  for (int columns : {30, 80, 120})
    for (const Figure& f : {waves(1), waves(3), waves(12), ball()}) {
      CAPTURE(columns);
      const std::string drawing = draw(checked(f), {columns, 40, Palette::none});
      CHECK(drawing == draw(checked(f), {columns, 40, Palette::none}));
      CHECK(drawing.find('\x1b') == std::string::npos);
      for (const std::string& line : lines_of(drawing)) {
        CHECK(display_width(line) <= columns);
        CHECK((line.empty() || line.back() != ' '));
      }
    }
  CHECK(draw(checked(waves(2)), {80, 40, Palette::ansi256}).find("\x1b[38;5;") != std::string::npos);
}

TEST_CASE("drawing: pipes have 80 columns and no colours") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const Terminal t = terminal_of(ends[1]);
  close(ends[0]);
  close(ends[1]);
  CHECK(t.columns == 80);
  CHECK(t.palette == Palette::none);
}

TEST_CASE("drawing: without colours every series has its own dashes or marks, and the legend shows them") {
  const std::string drawing = draw(checked(waves(6)));
  const auto lines = lines_of(drawing);
  std::vector<std::string> samples;
  for (const std::string& line : lines)
    for (size_t at = line.find(" wave "); at != std::string::npos; at = line.find(" wave ", at + 1))
      samples.push_back(line.substr(at < 18 ? 0 : at - 18, at < 18 ? at : 18));
  CHECK(samples.size() == 6);
  for (size_t i = 0; i < samples.size(); ++i)
    for (size_t j = 0; j < i; ++j) CHECK(samples[i] != samples[j]);
}

TEST_CASE("drawing: NaN is a gap and lonely points are still seen") {
  Figure f;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Vec x = Vec::LinSpaced(5, 0, 4), y(5);
  y << 1, nan, 1, nan, 1;
  f.series.push_back({"", x, y, {}, Style::line});
  const std::string drawing = draw(checked(f));
  CHECK(drawing.find("2 of 5 points of the data are not finite (drawn as gaps)") != std::string::npos);
  int cells = 0;  // braille characters begin with E2 A0 … E2 A3
  for (size_t i = 0; i + 1 < drawing.size(); ++i)
    if (drawing[i] == '\xE2' && static_cast<unsigned char>(drawing[i + 1]) >= 0xA0 &&
        static_cast<unsigned char>(drawing[i + 1]) <= 0xA3)
      ++cells;
  CHECK(cells == 3);
}

TEST_CASE("drawing: a circle with equal axes is as high as it is wide") {
  Figure f;
  f.equal = true;
  const Vec a = Vec::LinSpaced(300, 0, 6.2832);
  f.series.push_back({"", a.array().cos(), a.array().sin(), {}, Style::line});
  const auto lines = lines_of(draw(checked(f)));
  const int rows = static_cast<int>(lines.size()) - 3;  // without the frame and the x numbers
  const int columns = display_width(lines[0]) - 5 - 1;  // without the y numbers and the frame
  CHECK(std::abs(columns - 2 * rows) <= 2);             // a cell is twice as high as wide
}

TEST_CASE("drawing: 3-D shows the box, its numbers and the labels") {
  Figure f = ball();
  f.axes[0].label = "east";
  f.axes[1].label = "north";
  f.axes[2].label = "up";
  const std::string drawing = draw(checked(f));
  for (const char* word : {"east", "north", "up", "-1", "0", "1"})
    CHECK(drawing.find(word) != std::string::npos);
  for (double tilt : {0.0, 30.0, 90.0})
    for (double turn : {-120.0, 0.0, 45.0, 300.0}) {
      f.tilt = tilt;
      f.turn = turn;
      CHECK(draw(checked(f)).size() > 500);
    }
}

TEST_CASE("drawing: the time grows with the number of points, not faster") {
  const auto seconds = [](int points) {
    const Figure f = checked(waves(1, points));
    const auto start = std::chrono::steady_clock::now();
    draw(f);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  CHECK(seconds(1000000) < 50 * seconds(100000));  // 0.05 s and 0.005
}

}  // namespace pendula::braille_test
