#include "plot/film.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include <unistd.h>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "base/text.hpp"
#include "plot/gnuplot.hpp"
#include "plot/script.hpp"
#include "plot/sheet.hpp"

namespace pendula::plot {
namespace {

void wait_until(std::chrono::steady_clock::time_point then) {
  while (std::chrono::steady_clock::now() < then) {
    poll_interrupt();
    const auto rest = then - std::chrono::steady_clock::now();
    std::this_thread::sleep_for(
        std::min<std::chrono::steady_clock::duration>(rest, std::chrono::milliseconds(20)));
  }
}

}  // namespace

void play(const std::vector<Figure>& figures, double pause, std::string (*spelled)(const std::string&)) {
  if (figures.empty()) return;
  const Terminal terminal = terminal_of(STDOUT_FILENO);
  if (!isatty(STDOUT_FILENO)) {
    const std::string last = draw(figures.back(), terminal);
    std::fwrite(last.data(), 1, last.size(), stdout);
    return;
  }
  auto next = std::chrono::steady_clock::now();
  long rows = 0;
  for (const Figure& figure : figures) {
    const std::string picture = spelled(draw(figure, terminal));
    if (rows > 0) std::printf("\033[%ldA", rows);  // back to the first row of the previous figure
    std::fwrite(picture.data(), 1, picture.size(), stdout);
    std::fflush(stdout);
    rows = std::count(picture.begin(), picture.end(), '\n');
    next += std::chrono::microseconds(std::lround(1e6 * pause));
    wait_until(next);
  }
}

void save_film(const std::vector<Figure>& figures, double pause, const std::string& path) {
  if (figures.empty()) throw Error("an animation needs one figure at least");
  const Figure& first = figures[0];
  const int width = first.size[0] ? first.size[0] : 640, height = first.size[1] ? first.size[1] : 480;
  std::string script =
      "set encoding utf8\n" + text("set terminal gif animate delay ", std::max(2L, std::lround(100 * pause)),
                                   " loop 0 optimize noenhanced size ", width, ",", height,
                                   " font 'DejaVu Sans,11' background '#FFFFFF'\n");
  for (const Figure& figure : figures) {
    script += "unset label\nunset arrow\n";
    if (!figure.title.empty()) script += "set title " + quoted(figure.title) + " noenhanced\n";
    script += figure.three_d ? solid_script(figure) : flat_script(figure);
  }
  run_gnuplot(script, path);
}

}  // namespace pendula::plot
