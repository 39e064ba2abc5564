// Many figures as SVG texts by a single gnuplot process.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <unistd.h>

#include "base/error.hpp"
#include "plot/gnuplot.hpp"
#include "plot/script.hpp"

namespace pendula::plot {
namespace {

/// A file in the folder for temporary files, deleted by the destructor.
class TemporaryFile {
 public:
  TemporaryFile() : path_((std::filesystem::temp_directory_path() / "pendula-XXXXXX").string()) {
    const int descriptor = mkstemp(path_.data());
    if (descriptor < 0) throw Failure("no temporary file can be made: " + path_);
    close(descriptor);
  }
  ~TemporaryFile() { std::remove(path_.c_str()); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string contents(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

std::vector<std::string> svg_texts(const std::vector<Figure>& figures) {
  if (figures.empty()) return {};
  std::string script;
  for (const Figure& figure : figures) script += gnuplot_script(figure, "svg") + "unset output\nreset\n";
  const TemporaryFile file;
  run_gnuplot(script, file.path());
  const std::string all = contents(file.path());
  std::vector<std::string> texts;
  constexpr std::string_view end = "</svg>";
  for (std::size_t begin = all.find("<svg"), stop = 0; begin != std::string::npos;
       begin = all.find("<svg", stop)) {
    stop = all.find(end, begin);
    if (stop == std::string::npos) break;
    stop += end.size();
    texts.push_back(all.substr(begin, stop - begin));
  }
  if (texts.size() != figures.size())
    throw Failure(text("gnuplot drew ", texts.size(), " of ", figures.size(), " figures"));
  return texts;
}

}  // namespace pendula::plot
