// Reads lines without editing: for pipes, for dumb terminals, and for builds without readline.
#include <unistd.h>

#include <cstdio>

#include "shell/input/reader.hpp"
#include "shell/input/signals.hpp"

namespace pendula::shell {
namespace {

class PlainReader : public Reader {
 public:
  Line read(const std::string& pending) override {
    const auto prompt = pending.empty() ? first_prompt : next_prompt();
    std::fwrite(prompt.data(), 1, prompt.size(), stdout);
    std::fflush(stdout);
    PromptSignals signals;
    std::size_t end;
    while ((end = buffer_.find('\n')) == std::string::npos) {
      if (const int signal = signals.wait(STDIN_FILENO); signal == SIGINT) {
        buffer_.clear();
        std::puts("");
        return {Line::Kind::abandoned, ""};
      } else if (signal == 0 && !fill()) {
        return with(pending, last_line());
      } else if (signal != 0 && signal != SIGWINCH) {
        default_action(signal);
      }
    }
    Line line{Line::Kind::text, buffer_.substr(0, end)};
    buffer_.erase(0, end + 1);
    return with(pending, std::move(line));
  }

  void remember(const std::string&) override {}

 private:
  bool fill() {
    char chunk[4096];
    const ssize_t count = ::read(STDIN_FILENO, chunk, sizeof chunk);
    if (count > 0) buffer_.append(chunk, static_cast<std::size_t>(count));
    return count > 0;
  }

  static Line with(const std::string& pending, Line line) {
    if (line.kind == Line::Kind::text && !pending.empty()) line.text = pending + "\n" + line.text;
    return line;
  }

  /// The text after the last line break, at the end of the input.
  Line last_line() {
    if (buffer_.empty()) return {Line::Kind::end, ""};
    Line line{Line::Kind::text, buffer_};
    buffer_.clear();
    return line;
  }

  std::string buffer_;
};

}  // namespace

std::unique_ptr<Reader> open_plain_reader() { return std::make_unique<PlainReader>(); }

}  // namespace pendula::shell
