#include "shell/safe_mode.hpp"

#include <unistd.h>

#include <cstdlib>
#include <memory>

#include "base/error.hpp"
#include "lua/session/forbidden_calls.hpp"
#include "lua/session/state.hpp"
#include "shell/input/signals.hpp"
#include "shell/sandbox/harmless.hpp"
#include "shell/sandbox/json.hpp"
#include "shell/script.hpp"

namespace pendula::shell {
namespace {

struct Source {
  std::string text, chunk;
};

std::vector<Source> read_sources(const Options& options) {
  std::vector<Source> sources;
  for (const std::string& code : options.code) sources.push_back({code, "=-e"});
  if (options.script.empty()) {
    if (sources.empty()) throw UsageError("--safe needs a script: pendula --safe script.lua");
    return sources;
  }
  sources.push_back({read_source(options.script), chunk_name(options.script)});
  return sources;
}

/// The line number in "exam.lua:3: text"; 0 if there is none.
int line_of(const std::string& message) {
  const auto colon = message.find(':');
  if (colon == std::string::npos) return 0;
  char* end = nullptr;
  const long line = std::strtol(message.c_str() + colon + 1, &end, 10);
  return *end == ':' && line > 0 && line < 100000000 ? static_cast<int>(line) : 0;
}

class Confined {
 public:
  Confined(const Options& options, const std::vector<Source>& sources, sandbox::Reporter& reporter)
      : options_(options), sources_(sources), reporter_(reporter), state_(lua::new_state(), lua_close) {
    set_arguments(state_.get(), options.before, options.script, options.arguments);
    // Lua gets seven eighths; the rest is for allocations outside Lua.
    lua::forbid_calls(state_.get(), report_, options.limits.memory / 8 * 7);
  }

  bool work() {
    for (const Source& source : sources_) {
      const bool last = &source == &sources_.back();
      if (run_text(state_.get(), source.text, source.chunk,
                   last ? options_.arguments : std::vector<std::string>()))
        continue;
      reporter_.message(pop_error(state_.get()).text);
      return false;
    }
    state_.reset();  // writes files and runs finalizers while still in the sandbox
    return true;
  }

 private:
  const Options& options_;
  const std::vector<Source>& sources_;
  sandbox::Reporter& reporter_;
  const std::function<void(const std::string&)> report_ = [this](const std::string& call) {
    reporter_.forbidden(call);
  };
  std::unique_ptr<lua_State, decltype(&lua_close)> state_;
};

/// Passes on the output of the script; control characters for a terminal are made harmless.
class Output {
 public:
  explicit Output(std::FILE* file) : file_(file), terminal_(isatty(fileno(file)) != 0) {}
  void operator()(const char* bytes, std::size_t size) {
    if (terminal_)
      put(filter_({bytes, size}));
    else
      put({bytes, size});
  }
  void end() { put(filter_.rest()); }
  std::string words(const std::string& own) const { return terminal_ ? sandbox::harmless(own) : own; }

 private:
  void put(std::string_view bytes) {
    std::fwrite(bytes.data(), 1, bytes.size(), file_);
    std::fflush(file_);
  }
  std::FILE* file_;
  bool terminal_;
  sandbox::ControlFilter filter_;
};

std::string summary(const sandbox::Outcome& o) {
  std::string words = o.kind == sandbox::Kind::error ? "" : text("safe mode: ", sandbox::name_of(o.kind));
  for (const std::string& call : o.forbidden) words += (&call == &o.forbidden.front() ? ": " : ", ") + call;
  if (o.message.empty()) return words;
  return words.empty() ? o.message : words + "\n" + o.message;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> json_outcome(const sandbox::Outcome& o) {
  std::vector<std::string> forbidden;
  for (const std::string& call : o.forbidden) forbidden.push_back(sandbox::json_text(call));
  const int line = line_of(o.message);
  return {{"outcome", sandbox::json_text(sandbox::name_of(o.kind))},
          {"status", std::to_string(sandbox::status_of(o.kind))},
          {"message", o.message.empty() ? "null" : sandbox::json_text(o.message)},
          {"line", line > 0 ? std::to_string(line) : "null"},
          {"forbidden", sandbox::json_list(forbidden)},
          {"cpu_seconds", sandbox::json_number(o.processor_seconds)},
          {"seconds", sandbox::json_number(o.seconds)},
          {"memory_bytes", std::to_string(o.memory)}};
}

int run_safely(const Options& options) {
  const auto sources = read_sources(options);
  catch_interrupt_in_session();
  std::fflush(nullptr);  // the child must not inherit buffered output and write it again
  std::string out, err;
  Output shown(stdout), complaints(stderr);
  const auto print = [&](int descriptor, const char* bytes, std::size_t size) {
    if (options.json)
      (descriptor == 1 ? out : err).append(bytes, size);
    else
      (descriptor == 1 ? shown : complaints)(bytes, size);
  };
  const auto prepare = [&](sandbox::Reporter& reporter) -> sandbox::Work {
    auto confined = std::make_shared<Confined>(options, sources, reporter);
    return [confined] { return confined->work(); };
  };
  const sandbox::Outcome outcome = sandbox::run(options.limits, prepare, print);
  shown.end();
  complaints.end();
  if (options.json) {
    auto report = json_outcome(outcome);
    report.emplace_back("output", sandbox::json_text(out));
    report.emplace_back("errors", sandbox::json_text(err));
    std::printf("%s\n", sandbox::json_object(report).c_str());
  } else if (outcome.kind != sandbox::Kind::finished) {
    complain(complaints.words(summary(outcome)));
  }
  return sandbox::status_of(outcome.kind);
}

}  // namespace pendula::shell
