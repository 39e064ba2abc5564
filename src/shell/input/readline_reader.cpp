// Line editing with GNU readline through its callback interface. The plain readline() call loses characters
// after Ctrl-C; here signals are unblocked only inside ppoll(), and the state of a line abandoned by Ctrl-C
// is reset. Readline holds the text, its keys, the history and the search in it. On terminals that can move
// the cursor up, EntryView draws the entry, and an entry of several lines is edited as one block.
#ifdef PENDULA_READLINE

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
// readline.h needs FILE from <cstdio>
#include <readline/history.h>
#include <readline/readline.h>

#include "shell/input/entry_view.hpp"
#include "shell/input/history.hpp"
#include "shell/input/lines_of_entry.hpp"
#include "shell/input/reader.hpp"
#include "shell/input/signals.hpp"
#include "shell/input/terminal.hpp"
#include "shell/input/word_list.hpp"

namespace pendula::shell {
namespace {

class ReadlineReader : public Reader {
 public:
  explicit ReadlineReader(Knowledge knowledge);
  ~ReadlineReader() override { active_ = nullptr; }

  Line read(const std::string& pending) override;
  void remember(const std::string& entry) override;

 private:
  // Static because readline calls plain functions; there is only one terminal, hence one reader.
  static void take_line(char* text);
  static int tab(int count, int key);
  static char* word_breaks();
  static char** attempt(const char* text, int start, int end);
  static char* next_word(const char* text, int state);

  // Keys in an entry edited as a block.
  static int enter(int count, int key);
  static int right(int count, int key);
  static int line_end(int count, int key);
  static int delete_or_give_up(int count, int key);
  static int clear(int count, int key);
  static void redraw();
  static void list_words(char** matches, int count, int longest);

  void load();
  void bind_keys();
  std::string prompt(bool first) const;
  Entry entry() const;
  std::string suggestion() const;
  bool accept_suggestion();
  void write(const std::string& bytes) const;
  void finish();
  void on_signal(int signal);
  void abandon();

  static ReadlineReader* active_;
  Knowledge knowledge_;
  Completions completions_;
  EntryView view_;
  std::string path_ = history_path();
  std::string pending_;
  Line line_{Line::Kind::end, ""};
  bool done_ = false;
  bool colour_ = false;
  bool block_ = false;  ///< an entry is edited as a block; else line by line
};

ReadlineReader* ReadlineReader::active_ = nullptr;

ReadlineReader::ReadlineReader(Knowledge knowledge) : knowledge_(std::move(knowledge)) {
  active_ = this;
  rl_readline_name = "pendula";
  rl_catch_signals = 0;
  rl_catch_sigwinch = 0;
  // redirected output must not contain the prompt
  rl_outstream = is_terminal(STDOUT_FILENO) ? stdout : stderr;
  rl_variable_bind("enable-bracketed-paste", "on");  // the default; ~/.inputrc may override it
  // otherwise readline rebinds Ctrl-U, which has its own function in a block
  rl_variable_bind("bind-tty-special-chars", "off");
  rl_initialize();
  colour_ = has_colour(fileno(rl_outstream));
  rl_completion_word_break_hook = word_breaks;
  rl_attempted_completion_function = attempt;
  rl_completion_query_items = 400;  // readline would ask its question with signals blocked
  rl_variable_bind("page-completions", "off");
  // a history entry that was edited but not entered is restored
  rl_variable_bind("revert-all-at-newline", "on");
  rl_bind_key('\t', tab);
  const char* cursor_up = rl_get_termcap("up");
  block_ = cursor_up && *cursor_up;
  if (block_) {
    rl_redisplay_function = redraw;
    rl_completion_display_matches_hook = list_words;
    bind_keys();
  }
  load();
}

void ReadlineReader::bind_keys() {
  for (const char* map : {"emacs", "vi-insert", "vi-command"}) {
    for (const char* keys : {"\\C-m", "\\C-j"}) rebind(map, keys, rl_newline, enter);
    for (const char* keys : {"\\C-p", "\\e[A", "\\eOA", "k"}) rebind(map, keys, rl_get_previous_history, up);
    for (const char* keys : {"\\C-n", "\\e[B", "\\eOB", "j"}) rebind(map, keys, rl_get_next_history, down);
    for (const char* keys : {"\\C-f", "\\e[C", "\\eOC"}) rebind(map, keys, rl_forward_char, right);
    for (const char* keys : {"\\C-e", "\\e[F", "\\eOF", "\\e[4~"})
      rebind(map, keys, rl_end_of_line, line_end);
    for (const char* keys : {"\\C-a", "\\e[H", "\\eOH", "\\e[1~"})
      rebind(map, keys, rl_beg_of_line, line_begin);
    rebind(map, "\\C-k", rl_kill_line, kill_to_end);
    rebind(map, "\\C-u", rl_unix_line_discard, kill_to_begin);
    rebind(map, "\\C-d", rl_delete, delete_or_give_up);
    rebind(map, "\\C-l", rl_clear_screen, clear);
  }
  for (const char* keys : {"\\e\\C-m", "\\e\\C-j"})
    rl_bind_keyseq_in_map(keys, new_line, rl_get_keymap_by_name("emacs"));
}

void ReadlineReader::load() {
  using_history();
  for (const auto& entry : load_history(path_)) add_history(entry.c_str());
}

// ── reading ────────────────────────────────────────────────────────────────────────────────────────────────

std::string ReadlineReader::prompt(bool first) const {
  const std::string text(first ? first_prompt : next_prompt());
  return colour_ && !block_ ? "\001\033[1;34m\002" + text + "\001\033[0m\002" : text;
}

Line ReadlineReader::read(const std::string& pending) {
  pending_ = pending.empty() || block_ ? "" : pending + "\n";
  done_ = false;
  PromptSignals signals;
  rl_reset_screen_size();  // the window may have been resized during the computation
  view_.begin();
  rl_callback_handler_install(prompt(pending_.empty()).c_str(), take_line);
  if (block_ && !pending.empty()) {
    rl_insert_text((pending + "\n").c_str());
    redraw();
  }
  while (!done_) {
    if (const int signal = signals.wait(STDIN_FILENO)) {
      on_signal(signal);
    } else {
      rl_callback_read_char();
    }
  }
  if (line_.kind == Line::Kind::text) line_.text = pending_ + line_.text;
  return std::move(line_);
}

/// Readline calls this with a finished line, or with null at the end of the input.
void ReadlineReader::take_line(char* text) {
  rl_callback_handler_remove();  // restores the normal mode of the terminal during the computation
  active_->line_ = {text ? Line::Kind::text : Line::Kind::end, text ? text : ""};
  active_->done_ = true;
  std::free(text);
}

void ReadlineReader::on_signal(int signal) {
  switch (signal) {
    case SIGINT:
      return abandon();
    case SIGWINCH: {
      rl_reset_screen_size();
      int rows, columns;
      rl_get_screen_size(&rows, &columns);
      if (block_) view_.resized(entry(), columns);
      return rl_resize_terminal();
    }
    case SIGTSTP:
      if (block_) finish();
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
  rl_callback_sigcleanup();  // ends a search or an incomplete key sequence
  rl_free_line_state();
  rl_point = rl_end;  // the new prompt must begin below a line of several rows
  done_ = true;       // no suggestion after the abandoned entry
  rl_redisplay_function();
  std::fputs("^C\n", rl_outstream);
  rl_callback_handler_remove();
  line_ = {Line::Kind::abandoned, ""};
}

void ReadlineReader::remember(const std::string& entry) {
  const HIST_ENTRY* last = history_length > 0 ? history_get(history_base + history_length - 1) : nullptr;
  if (last && entry == last->line) return;
  add_history(entry.c_str());
  append_history(path_, entry);
}

// ── display ────────────────────────────────────────────────────────────────────────────────────────────────

void ReadlineReader::write(const std::string& bytes) const {
  std::fwrite(bytes.data(), 1, bytes.size(), rl_outstream);
  std::fflush(rl_outstream);
}

/// The rest of the newest history entry that begins with the text typed so far.
std::string ReadlineReader::suggestion() const {
  if (!colour_ || done_ || rl_point != rl_end || rl_end == 0 || rl_readline_state & RL_STATE_ISEARCH)
    return "";
  const std::string_view text = typed();
  for (int i = history_length - 1; i >= 0; --i) {
    const HIST_ENTRY* past = history_get(history_base + i);
    if (past && std::strncmp(past->line, text.data(), text.size()) == 0 && past->line[text.size()])
      return past->line + text.size();
  }
  return "";
}

Entry ReadlineReader::entry() const {
  Entry entry;
  entry.text = typed();
  entry.cursor = static_cast<std::size_t>(rl_point);
  entry.prompt =
      rl_display_prompt ? std::string_view(rl_display_prompt) : first_prompt;  // or the prompt of a search
  entry.coloured = colour_;
  if (colour_)
    entry.styles = highlighted(entry.text, done_ ? entry.text.size() : entry.cursor, knowledge_.kind);
  return entry;
}

void ReadlineReader::redraw() {
  auto& self = *active_;
  int rows, columns;
  rl_get_screen_size(&rows, &columns);
  const std::string ghost = self.suggestion();
  Entry entry = self.entry();
  entry.ghost = ghost;
  self.write(self.view_.show(entry, columns, rows));
}

/// Draws the finished entry and moves the cursor below it.
void ReadlineReader::finish() {
  int rows, columns;
  rl_get_screen_size(&rows, &columns);
  write(view_.leave(entry(), columns, rows));
}

int ReadlineReader::clear(int, int) {
  active_->write("\033[H\033[2J");
  active_->view_.begin();
  redraw();
  return 0;
}

// ── keys of a block ────────────────────────────────────────────────────────────────────────────────────────

int ReadlineReader::enter(int count, int key) {
  auto& self = *active_;
  if (!self.knowledge_.is_complete(std::string(typed()))) return new_line(count, key);
  if (!more_is_coming()) align_line();
  self.done_ = true;
  self.finish();
  self.done_ = false;
  rl_done = 1;
  return 0;
}

bool ReadlineReader::accept_suggestion() {
  const std::string rest = suggestion();
  if (!rest.empty()) rl_insert_text(rest.c_str());
  return !rest.empty();
}

int ReadlineReader::right(int count, int key) {
  return active_->accept_suggestion() ? 0 : rl_forward_char(count, key);
}

int ReadlineReader::line_end(int, int) {
  if (!active_->accept_suggestion()) rl_point = end_of_line(rl_point);
  return 0;
}

/// Ctrl-D deletes a character; on the empty last line of an incomplete entry it abandons the entry.
int ReadlineReader::delete_or_give_up(int count, int key) {
  const auto line = typed().substr(static_cast<std::size_t>(begin_of_line(rl_end)));
  const bool waits = rl_point == rl_end && line.size() < typed().size();
  if (!waits || line.find_first_not_of(' ') != line.npos) return rl_delete(count, key);
  active_->done_ = true;
  active_->finish();
  active_->done_ = false;
  rl_replace_line("", 1);
  rl_done = 1;
  return 0;
}

// ── completion ─────────────────────────────────────────────────────────────────────────────────────────────

/// Tab before the first word of a continuation line indents; elsewhere it completes.
int ReadlineReader::tab(int count, int key) {
  const auto before = before_cursor();
  const auto line = before.substr(before.rfind('\n') + 1);
  const bool continued = !active_->pending_.empty() || line.size() < before.size();
  if (continued && line.find_first_not_of(' ') == std::string_view::npos) {
    rl_insert_text("  ");
    return 0;
  }
  if (rl_last_func == tab) rl_last_func = rl_complete;  // makes a second Tab list the possibilities
  return rl_complete(count, key);
}

/// Readline calls this before it determines the word to complete; inside quotes the word begins at the quote.
char* ReadlineReader::word_breaks() {
  static char in_code[] = " \t\n\"\\'`@$><=;|&{}()[],+-*/%^~#!?.:";
  static char in_string[] = "\"'";
  auto& self = *active_;
  self.completions_ = self.knowledge_.complete(self.pending_ + std::string(before_cursor()));
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

/// Readline calls this until it returns null, and frees the results.
char* ReadlineReader::next_word(const char*, int state) {
  static std::size_t next = 0;
  if (state == 0) next = 0;
  const auto& words = active_->completions_.words;
  return next < words.size() ? strdup(words[next++].c_str()) : nullptr;
}

/// matches[1 … count] are the words; matches[0] is their common beginning.
void ReadlineReader::list_words(char** matches, int count, int) {
  auto& self = *active_;
  int rows, columns;
  rl_get_screen_size(&rows, &columns);
  const std::vector<std::string> words(matches + 1, matches + 1 + count);
  self.done_ = true;  // hides the suggestion, which would be drawn before the list
  self.finish();
  self.done_ = false;
  self.write(word_list(words, self.completions_.globals ? self.knowledge_.kind : NameLookup{},
                       {columns, rows - 2, self.colour_}));
  rl_forced_update_display();
}

}  // namespace

std::unique_ptr<Reader> open_readline_reader(Knowledge knowledge) {
  return std::make_unique<ReadlineReader>(std::move(knowledge));
}

}  // namespace pendula::shell

#endif
