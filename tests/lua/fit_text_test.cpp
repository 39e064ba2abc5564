// Text fitted to the width of a screen.
#include <doctest/doctest.h>

#include <algorithm>
#include <sstream>

#include "base/text.hpp"
#include "lua/screen/fit_text.hpp"

namespace pendula::fit_text_test {

using pendula::display_width;
using pendula::lua::fitted;
using pendula::lua::in_ascii;

namespace {

int widest(const std::string& text) {
  int width = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) width = std::max(width, display_width(line));
  return width;
}

std::string without_blanks(std::string text) {
  std::string out;
  for (char c : text)
    if (c != ' ' && c != '\n') out += c;
  return out;
}

}  // namespace

TEST_CASE("fitted: what fits stays") {
  CHECK(fitted("x = 1\ny = 2", 40) == "x = 1\ny = 2");
  CHECK(fitted("", 40) == "");
  CHECK(fitted(std::string(200, 'x'), 0) == std::string(200, 'x'));  // no terminal
}

TEST_CASE("fitted: equations break in front of = + and -") {
  const std::string equation = "  (1a)  m L² θ″ + m g L sin(θ) - d θ′ cos(φ - θ) + k (θ - φ) = F cos(θ) + M";
  for (int columns : {30, 40, 60}) {
    const std::string text = fitted(equation, columns);
    CHECK(widest(text) <= columns);
    CHECK(without_blanks(text) == without_blanks(equation));  // nothing is lost
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      const std::string sign = line.substr(line.find_first_not_of(' '), 1);
      CHECK((sign == "+" || sign == "-" || sign == "="));
      CHECK(line.substr(0, 8) == "        ");  // below the equation, not below its number
    }
  }
}

TEST_CASE("fitted: words are wrapped, words that are too long stay whole") {
  const std::string words =
      "constraints become dependent where the arm is stretched and the joint cannot move any more";
  const std::string text = fitted(words, 40);
  CHECK(widest(text) <= 40);
  CHECK(without_blanks(text) == without_blanks(words));
  CHECK(fitted(std::string(60, 'x') + " y", 40).find(std::string(60, 'x')) != std::string::npos);
}

TEST_CASE("fitted: wide matrices lose columns in the middle") {
  std::string matrix;
  for (int i = 0; i < 6; ++i) {
    matrix += i == 0 ? "A = ⎡" : i == 5 ? "    ⎣" : "    ⎢";
    for (int j = 0; j < 30; ++j) matrix += (j ? "  " : "") + std::to_string(10 + i + j);
    matrix += i == 0 ? "⎤\n" : i == 5 ? "⎦" : "⎥\n";
  }
  for (int columns : {40, 80}) {
    const std::string text = fitted(matrix, columns);
    CHECK(widest(text) <= columns);
    CHECK(text.find("⋯  39⎤") != std::string::npos);  // the last column is there
    CHECK(text.find("A = ⎡10  11") != std::string::npos);
  }
}

TEST_CASE("fitted: tables of numbers without brackets") {
  std::string table;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 20; ++j) table += "  0.12" + std::to_string(10 + j);
    table += "\n";
  }
  CHECK(widest(fitted(table, 60)) <= 60);
  CHECK(fitted(table, 60).find("⋯") != std::string::npos);
}

TEST_CASE("in_ascii: mathematics as it is typed") {
  CHECK(in_ascii("θ₁′ = √2 x²") == "theta1' = sqrt 2 x^2");
  CHECK(in_ascii("⎡1 0⎤") == "[1 0]");
  CHECK(in_ascii("plain") == "plain");
  for (char c : in_ascii("⠤ unknown ☃")) CHECK(static_cast<unsigned char>(c) < 128);
}

TEST_CASE("fitted: a tableau or a state space loses columns in the middle, all rows the same ones") {
  const std::string tableau =
      "0    │\n"
      "1/5  │ 1/5\n"
      "3/10 │ 3/40        9/40\n"
      "4/5  │ 44/45       -56/15\n"
      "─────┼──────────────────────────────────────────\n"
      "     │ 35/384      0            500/1113    84";
  CHECK(fitted(tableau, 60) == tableau);
  const std::string text = fitted(tableau, 40);
  CHECK(widest(text) <= 40);
  CHECK(text.find("4/5  │ 44/45       -56/15 ⋯") != std::string::npos);
  CHECK(text.find("     │ 35/384      0      ⋯  84") != std::string::npos);
  CHECK(text.find("─────┼──") != std::string::npos);
  CHECK(std::count(text.begin(), text.end(), '\n') == 5);
}

}  // namespace pendula::fit_text_test
