// Line editing with GNU readline through its callback interface. The plain readline() call swallows
// characters after Ctrl-C; here signals are let in only inside ppoll(), and a line that Ctrl-C abandons is
// taken down properly.
#ifdef PENDULA_READLINE

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
// readline.h needs FILE from <cstdio>
#include <readline/history.h>
#include <readline/readline.h>

#include "shell/input/history.hpp"
#include "shell/input/reader.hpp"
#include "shell/input/signals.hpp"
#include "shell/input/terminal.hpp"

namespace pendula::shell {
namespace {

class ReadlineReader : public Reader {
 public:
  explicit ReadlineReader(Completer completer);
  ~ReadlineReader() override { active_ = nullptr; }

  Line read(const std::string& pending) override;
  void remember(const std::string& entry) override;

 private:
  // Readline knows only plain functions; there is one terminal, hence one reader.
  static void take_line(char* text);
  static int tab(int count, int key);
  static char* word_breaks();
  static char** attempt(const char* text, int start, int end);
  static char* next_word(const char* text, int state);

  std::string prompt(bool first) const;
  void on_signal(int signal);
  void abandon();
  void load();

  static ReadlineReader* active_;
  Completer completer_;
  Completions completions_;
  std::string path_ = history_path();
  std::string pending_;
  Line line_{Line::Kind::end, ""};
  bool done_ = false;
  bool colour_ = false;
};

ReadlineReader* ReadlineReader::active_ = nullptr;

ReadlineReader::ReadlineReader(Completer completer) : completer_(std::move(completer)) {
  active_ = this;
  rl_readline_name = "pendula";
  rl_catch_signals = 0;
  rl_catch_sigwinch = 0;
  rl_outstream = is_terminal(STDOUT_FILENO) ? stdout : stderr;  // the prompt is no part of redirected output
  rl_variable_bind("enable-bracketed-paste", "on");             // the default; ~/.inputrc may refuse
  rl_initialize();
  colour_ = has_colour(fileno(rl_outstream));
  rl_completion_word_break_hook = word_breaks;
  rl_attempted_completion_function = attempt;
  rl_completion_query_items = 400;  // the question would be asked with signals blocked
  rl_variable_bind("page-completions", "off");
  rl_variable_bind("revert-all-at-newline", "on");  // a history entry edited in passing stays as it was
  rl_bind_key('\t', tab);
  load();
}

void ReadlineReader::load() {
  using_history();
  for (const auto& entry : load_history(path_)) add_history(entry.c_str());
}

std::string ReadlineReader::prompt(bool first) const {
  const std::string text(first ? first_prompt : next_prompt);
  return colour_ ? "\001\033[1;34m\002" + text + "\001\033[0m\002" : text;
}

Line ReadlineReader::read(const std::string& pending) {
  pending_ = pending.empty() ? "" : pending + "\n";
  done_ = false;
  PromptSignals signals;
  rl_reset_screen_size();  // the window may have changed while we computed
  rl_callback_handler_install(prompt(pending.empty()).c_str(), take_line);
  while (!done_) {
    if (const int signal = signals.wait(STDIN_FILENO)) {
      on_signal(signal);
    } else {
      rl_callback_read_char();
    }
  }
  return std::move(line_);
}

/// Readline calls this with a finished line, or with null at the end of the input.
void ReadlineReader::take_line(char* text) {
  rl_callback_handler_remove();  // the terminal is as usual while we compute
  active_->line_ = {text ? Line::Kind::text : Line::Kind::end, text ? text : ""};
  active_->done_ = true;
  std::free(text);
}

void ReadlineReader::on_signal(int signal) {
  switch (signal) {
    case SIGINT:
      return abandon();
    case SIGWINCH:
      return rl_resize_terminal();
    case SIGTSTP:
      rl_cleanup_after_signal();
      default_action(signal);
      rl_reset_after_signal();
      rl_forced_update_display();
      return;
    default:
      rl_callback_handler_remove();
      default_action(signal);
  }
}

void ReadlineReader::abandon() {
  rl_callback_sigcleanup();  // leaves a search or a half-typed key sequence
  rl_free_line_state();
  rl_point = rl_end;  // so that the new prompt begins below a line that takes several rows
  rl_redisplay();
  std::fputs("^C\n", rl_outstream);
  rl_callback_handler_remove();
  line_ = {Line::Kind::abandoned, ""};
  done_ = true;
}

void ReadlineReader::remember(const std::string& entry) {
  const HIST_ENTRY* last = history_length > 0 ? history_get(history_base + history_length - 1) : nullptr;
  if (last && entry == last->line) return;
  add_history(entry.c_str());
  append_history(path_, entry);
}

/// On a continuation line, Tab before the first word indents; elsewhere it completes.
int ReadlineReader::tab(int count, int key) {
  const std::string_view before(rl_line_buffer, static_cast<std::size_t>(rl_point));
  const auto line = before.substr(before.rfind('\n') + 1);
  const bool continued = !active_->pending_.empty() || line.size() < before.size();
  if (continued && line.find_first_not_of(' ') == std::string_view::npos) return rl_insert_text("  "), 0;
  if (rl_last_func == tab) rl_last_func = rl_complete;  // a second Tab lists the possibilities
  return rl_complete(count, key);
}

/// Called before the word is cut out of the line: inside quotes it reaches back to the quote.
char* ReadlineReader::word_breaks() {
  static char in_code[] = " \t\n\"\\'`@$><=;|&{}()[],+-*/%^~#!?.:";
  static char in_string[] = "\"'";
  auto& self = *active_;
  self.completions_ =
      self.completer_(self.pending_ + std::string(rl_line_buffer, static_cast<std::size_t>(rl_point)));
  return self.completions_.quote ? in_string : in_code;
}

char** ReadlineReader::attempt(const char* text, int, int end) {
  rl_attempted_completion_over = 1;
  rl_completion_append_character = '\0';
  const char quote = active_->completions_.quote;
  if (quote && rl_line_buffer[end] != quote) rl_completion_append_character = quote;
  if (!active_->completions_.files) return rl_completion_matches(text, next_word);
  rl_filename_completion_desired = 1;
  return rl_completion_matches(text, rl_filename_completion_function);
}

/// Readline asks until it gets null, and frees what it got.
char* ReadlineReader::next_word(const char*, int state) {
  static std::size_t next = 0;
  if (state == 0) next = 0;
  const auto& words = active_->completions_.words;
  return next < words.size() ? strdup(words[next++].c_str()) : nullptr;
}

}  // namespace

std::unique_ptr<Reader> open_readline_reader(Completer completer) {
  return std::make_unique<ReadlineReader>(std::move(completer));
}

}  // namespace pendula::shell

#endif
