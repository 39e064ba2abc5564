// Moving and editing by lines within an entry: readline's own commands know one line only.
// The text, the cursor and the history are readline's; a function with (count, key) is a
// command that a key can be bound to.
#pragma once

#include <cstdio>
#include <string_view>
// readline.h needs FILE from <cstdio>
#include <readline/readline.h>

namespace pendula::shell {

std::string_view typed();          ///< the entry
std::string_view before_cursor();  ///< and what of it stands before the cursor

/// The first character of the line at `at`, and the one behind its last.
int begin_of_line(int at);
int end_of_line(int at);

/// Is more input there already? Then lines are pasted, with their own blanks in front.
bool more_is_coming();

/// A line that only closes a block or bracket goes to where that was opened.
void align_line();

int new_line(int count, int key);       ///< a line break with the blanks that the block asks for
int line_begin(int count, int key);     ///< to the begin of the line
int kill_to_end(int count, int key);    ///< at the end of a line its line break goes, too
int kill_to_begin(int count, int key);  ///< what stands before the cursor in its line

/// To the line above; on the first one to the entry before, at the end of its first line, so that the key
/// goes on through the history and Down goes through the lines.
int up(int count, int key);
int down(int count, int key);

/// In one of readline's key maps; keys that ~/.inputrc gave to something else keep it.
void rebind(const char* map_name, const char* keys, rl_command_func_t* usual, rl_command_func_t* now);

}  // namespace pendula::shell
