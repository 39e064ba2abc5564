// Saved figures: the script says what the figure says, nothing of the user's is
// executed, files appear whole or not.
#include "plot/gnuplot.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "plot/script.hpp"

namespace pendula::gnuplot_test {

using namespace pendula::plot;
namespace fs = std::filesystem;

namespace {

struct Folder {
  fs::path path = fs::temp_directory_path() / ("pendula-plot-test-" + std::to_string(std::rand()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  std::string operator/(const std::string& name) const { return (path / name).string(); }
  size_t files() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }
};

bool has_gnuplot() { return std::system("gnuplot --version >/dev/null 2>&1") == 0; }

std::string contents(const std::string& path) {
  std::ostringstream out;
  out << std::ifstream(path, std::ios::binary).rdbuf();
  return out.str();
}

Figure drift() {
  Figure f;
  f.title = "Drift of <C> & it's \"law\" `touch /tmp/pendula-injected` $(x)";
  f.axes[0].label = "t [s]";
  f.axes[1].label = "C [m²]";
  const Vec t = Vec::LinSpaced(50, 0, 10);
  f.series.push_back({"C₁", t, 1e-8 * t, {}, Style::line});
  f.series.push_back({"C_2^{x}", t, -4e-9 * t, {}, Style::line_points});
  return f;
}

Figure ball() {
  Figure f;
  f.three_d = f.equal = true;
  f.axes[2].label = "up [m]";
  f.surfaces.push_back(sphere(1, {0, 0, 0}));
  const Vec t = Vec::LinSpaced(200, 0, 6.28);
  f.series.push_back({"p", t.array().cos(), t.array().sin(), t.array() / 10, Style::line});
  return f;
}

}  // namespace

TEST_CASE("gnuplot: saves SVG, PNG and PDF that contain what was asked") {
  if (!has_gnuplot()) return;
  const Folder folder;
  for (const Figure& f : {checked(drift()), checked(ball())}) {
    for (const char* name : {"a.svg", "a.png", "a.PDF"}) save(f, folder / name);
    CHECK(contents(folder / "a.svg").substr(0, 5) == "<?xml");
    CHECK(contents(folder / "a.png").substr(1, 3) == "PNG");
    CHECK(contents(folder / "a.PDF").substr(0, 5) == "%PDF-");
  }
  save(checked(drift()), folder / "b.svg");
  const std::string svg = contents(folder / "b.svg");
  for (const char* word : {"t [s]", "C [m²]", "×10⁻⁷", "C₁", "C_2^{x}", "&lt;C> &amp; it", "$(x)"}) {
    INFO(std::string(word));
    CHECK(svg.find(word) != std::string::npos);
  }
  save(checked(drift()), folder / "c.svg");
  CHECK(contents(folder / "c.svg") == svg);  // no date, no name of its own
  CHECK(!fs::exists("/tmp/pendula-injected"));
  CHECK(folder.files() == 5);  // nothing is left over
}

TEST_CASE("gnuplot: every style, log axes, gaps and reversed axes are accepted") {
  if (!has_gnuplot()) return;
  const Folder folder;
  Figure f;
  f.axes[0].log = f.axes[1].log = true;
  const Vec x = Vec::LinSpaced(40, 1, 100);
  for (const std::string& style : style_names()) {
    Vec y = x.array().pow(-2);
    y[7] = std::numeric_limits<double>::quiet_NaN();
    y[9] = 0;
    f.series.push_back({style, x, y, {}, style_named(style)});
  }
  f.axes[1].reversed = true;
  CHECK_NOTHROW(save(checked(f), folder / "styles.svg"));
  Figure solid = ball();
  for (const std::string& style : style_names()) {
    solid.series.push_back(solid.series[0]);
    solid.series.back().style = style_named(style);
  }
  for (double tilt : {0.0, 90.0}) {
    solid.tilt = tilt;
    CHECK_NOTHROW(save(checked(solid), folder / "solid.svg"));
  }
}

TEST_CASE("gnuplot: what the user can repair is said before gnuplot starts") {
  const Figure f = checked(drift());
  const Folder folder;
  CHECK_THROWS_WITH(
      save(f, "a.jpg"),
      "cannot save 'a.jpg': unknown extension '.jpg'; the extension says the format: .svg, .png or .pdf");
  CHECK_THROWS_WITH(save(f, "x.y/a"),
                    "cannot save 'x.y/a': the file name has no extension; the extension says the format: "
                    ".svg, .png or .pdf");
  CHECK_THROWS_WITH(
      save(f, "/nowhere/at all/a.svg"),
      "cannot save '/nowhere/at all/a.svg': there is no folder '/nowhere/at all/'; make it first");
  fs::create_directories(folder / "d.svg");
  CHECK_THROWS_WITH(save(f, folder / "d.svg"),
                    ("cannot save '" + (folder / "d.svg") + "': it is a folder").c_str());
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  CHECK_THROWS_WITH_AS(save(f, folder / "a.svg"), doctest::Contains("apt-get install gnuplot-nox"), Error);
  setenv("PATH", path.c_str(), 1);
  CHECK(folder.files() == 1);  // the folder d.svg
}

TEST_CASE("gnuplot: Ctrl-C ends it and leaves no file") {
  if (!has_gnuplot()) return;
  const Folder folder;
  interrupt_requested = true;
  CHECK_THROWS_AS(save(checked(drift()), folder / "a.svg"), Interrupted);
  interrupt_requested = false;
  CHECK(folder.files() == 0);
}

TEST_CASE("gnuplot: texts are quoted so that nothing in them is executed") {
  CHECK(quoted("it's") == R"('it' . "'" . 's')");
  CHECK(quoted("f''(x)") == R"('f' . "''" . '(x)')");
  CHECK(quoted("a\nset output 'x'\n`id`") == R"('a set output ' . "'" . 'x' . "'" . ' `id`')");
  CHECK(translucent("#808080", 0.25) == "#BF808080");
}

TEST_CASE("gnuplot: long curves are thinned to what can be seen") {
  Figure f;
  const Vec t = Vec::LinSpaced(1000000, 0, 10);
  f.series.push_back({"", t, t.array().sin().matrix(), {}, Style::line});
  f.series[0].y[500000] = std::numeric_limits<double>::quiet_NaN();
  const auto kept = thinned(f, f.series[0]);
  CHECK(kept.size() < 20000);
  CHECK(kept.front() == 0);
  CHECK(kept.back() == 999999);
  CHECK(std::count(kept.begin(), kept.end(), -1) == 1);
  // No point between two kept ones is farther than the resolution from the first of them.
  for (size_t k = 1; k < kept.size(); ++k)
    if (kept[k] >= 0 && kept[k - 1] >= 0)
      for (Eigen::Index i = kept[k - 1]; i < kept[k]; ++i)
        REQUIRE(std::abs(f.series[0].y[i] - f.series[0].y[kept[k - 1]]) <= 2.16 / 4000);
}

}  // namespace pendula::gnuplot_test
