#ifdef PENDULA_READLINE

#include "shell/input/lines_of_entry.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <string>

#include "shell/input/highlight.hpp"

namespace pendula::shell {
namespace {

/// Characters of UTF-8, for keeping the column.
int characters(int begin, int end) {
  int count = 0;
  for (int i = begin; i < end; ++i) count += (rl_line_buffer[i] & 0xC0) != 0x80;
  return count;
}

void go_to_column(int begin, int column) {
  rl_point = begin;
  for (const int end = end_of_line(begin); rl_point < end && column > 0; --column) {
    ++rl_point;
    while (rl_point < end && (rl_line_buffer[rl_point] & 0xC0) == 0x80) ++rl_point;
  }
}

}  // namespace

std::string_view typed() { return {rl_line_buffer, static_cast<std::size_t>(rl_end)}; }
std::string_view before_cursor() { return typed().substr(0, static_cast<std::size_t>(rl_point)); }

int begin_of_line(int at) {
  while (at > 0 && rl_line_buffer[at - 1] != '\n') --at;
  return at;
}
int end_of_line(int at) {
  while (at < rl_end && rl_line_buffer[at] != '\n') ++at;
  return at;
}

bool more_is_coming() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return poll(&input, 1, 0) > 0;
}

void align_line() {
  const int begin = begin_of_line(rl_point);
  const auto above = typed().substr(0, static_cast<std::size_t>(begin));
  const auto line = before_cursor().substr(above.size());
  const auto blanks = line.find_first_not_of(' ');
  if (begin == 0 || blanks == line.npos || !begins_with_end(line)) return;
  const std::size_t deep = indentation(above), wanted = deep < 2 ? 0 : deep - 2;
  const int behind = rl_point - static_cast<int>(blanks) + static_cast<int>(wanted);
  rl_delete_text(begin, begin + static_cast<int>(blanks));
  rl_point = begin;
  rl_insert_text(std::string(wanted, ' ').c_str());
  rl_point = behind;
}

int new_line(int, int) {
  const bool pasted = more_is_coming();
  rl_begin_undo_group();
  if (!pasted) align_line();
  rl_insert_text(("\n" + std::string(pasted ? 0 : indentation(before_cursor()), ' ')).c_str());
  rl_end_undo_group();
  return 0;
}

int up(int count, int key) {
  const int begin = begin_of_line(rl_point);
  if (begin > 0) {
    go_to_column(begin_of_line(begin - 1), characters(begin, rl_point));
    return 0;
  }
  const int result = rl_get_previous_history(count, key);
  rl_point = end_of_line(0);
  return result;
}

int down(int count, int key) {
  const int begin = begin_of_line(rl_point), end = end_of_line(rl_point);
  if (end == rl_end) return rl_get_next_history(count, key);
  go_to_column(end + 1, characters(begin, rl_point));
  return 0;
}

int line_begin(int, int) {
  rl_point = begin_of_line(rl_point);
  return 0;
}

int kill_to_end(int, int) {
  const int end = end_of_line(rl_point);
  return rl_kill_text(rl_point, end == rl_point && end < rl_end ? end + 1 : end);
}

int kill_to_begin(int, int) {
  const int begin = begin_of_line(rl_point), end = rl_point;
  rl_kill_text(begin, end);
  rl_point = begin;
  return 0;
}

void rebind(const char* map_name, const char* keys, rl_command_func_t* usual, rl_command_func_t* now) {
  const Keymap map = rl_get_keymap_by_name(map_name);
  std::array<char, 32> bytes = {};
  int length = 0;
  rl_translate_keyseq(keys, bytes.data(), &length);
  if (rl_function_of_keyseq(bytes.data(), map, nullptr) == usual) rl_bind_keyseq_in_map(keys, now, map);
}

}  // namespace pendula::shell

#endif
