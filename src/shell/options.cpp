#include "shell/options.hpp"

#include "base/text.hpp"

namespace pendula::shell {
namespace {

const std::vector<std::string> long_options = {"--help", "--version", "--licences", "--no-color", "--safe",
                                               "--time", "--memory",  "--folder",   "--json"};

/// Reads --time, --memory, --folder with their values, --safe or --json; false if the word is none of them.
bool read_limit(const std::vector<std::string>& words, std::size_t& i, Options& options) {
  const std::string& word = words[i];
  if (word == "--safe") return options.safe = true;
  if (word == "--json") return options.json = true;
  const auto equals = word.find('=');
  const std::string name = word.substr(0, equals);
  if (name != "--time" && name != "--memory" && name != "--folder") return false;
  const char* const example = name == "--time" ? "10s" : name == "--memory" ? "1G" : "results";
  if (equals == std::string::npos && i + 1 == words.size())
    throw UsageError("option " + name + " needs a value, as in " + name + " " + example);
  const std::string value = equals == std::string::npos ? words[++i] : word.substr(equals + 1);
  try {
    if (name == "--time") options.limits.seconds = sandbox::seconds_of(value);
    if (name == "--memory") options.limits.memory = sandbox::bytes_of(value);
  } catch (const std::invalid_argument& e) {
    throw UsageError("option " + name + ": " + e.what());
  }
  if (name == "--folder") options.limits.folder = value;
  options.limited = true;
  return true;
}

/// Reads one option at words[i] and advances i to the last word read.
void read_option(const std::vector<std::string>& words, std::size_t& i, Options& options) {
  const std::string& word = words[i];
  if (word == "-e") {
    if (i + 1 == words.size()) throw UsageError("option -e needs a text: pendula -e 'print(1 + 1)'");
    options.code.push_back(words[++i]);
  } else if (word.rfind("-e", 0) == 0) {
    options.code.push_back(word.substr(2));
  } else if (read_limit(words, i, options)) {
  } else if (word == "-i") {
    options.interactive = true;
  } else if (word == "--no-color") {
    options.colour = false;
  } else if (word == "-v" || word == "--version") {
    options.action = Options::Action::version;
  } else if (word == "--licences") {
    options.action = Options::Action::licences;
  } else if (word == "-h" || word == "--help") {
    options.action = Options::Action::help;
  } else {
    throw UsageError("unknown option '" + word + "'." + did_you_mean(word, long_options));
  }
}

/// Words that are accepted in place of a script, and the file of stdlib that implements each.
struct Tool {
  const char *word, *file;
};
constexpr Tool tools[] = {{"report", "document/report"},
                          {"manual", "document/manual"},
                          {"kernel", "document/kernel"},
                          {"shard", "many/shard"},
                          {"sweep", "many/command"}};

const Tool* tool_named(const std::string& word) {
  for (const Tool& tool : tools)
    if (word == tool.word) return &tool;
  return nullptr;
}

void take_rest(const std::vector<std::string>& words, std::size_t i, std::vector<std::string>& rest) {
  rest.assign(words.begin() + static_cast<std::ptrdiff_t>(i), words.end());
}

}  // namespace

Options parse_options(const std::vector<std::string>& words) {
  Options options;
  std::size_t i = 1;
  bool only_operands = false;
  for (; i < words.size(); ++i) {
    if (words[i] == "--" && !only_operands) {
      only_operands = true;
    } else if (only_operands || words[i] == "-" || words[i].rfind('-', 0) != 0) {
      break;
    } else {
      read_option(words, i, options);
      if (options.action != Options::Action::run) return options;
    }
  }
  options.before.assign(words.begin(),
                        words.begin() + static_cast<std::ptrdiff_t>(std::min(i, words.size())));
  const bool grades = i < words.size() && words[i] == "grade" && !only_operands && options.code.empty();
  if ((options.json || options.limited) && !options.safe && !grades)
    throw UsageError(
        "--time, --memory, --folder and --json go with --safe, as in pendula --safe script.lua --json");
  if (options.safe && options.interactive) throw UsageError("--safe and -i exclude each other");
  if (i >= words.size()) return options;
  if (words[i] == "test" && !only_operands && options.code.empty() && !options.interactive) {
    options.action = Options::Action::test;
    take_rest(words, i + 1, options.arguments);
    if (options.arguments.empty())
      throw UsageError("'pendula test' needs files or folders: pendula test tests");
    return options;
  }
  if (const Tool* tool = tool_named(words[i]);
      tool && !only_operands && options.code.empty() && !options.interactive) {
    options.action = Options::Action::tool;
    options.tool = tool->file;
    take_rest(words, i + 1, options.arguments);
    return options;
  }
  if (grades) {
    options.action = Options::Action::grade;
    for (++i; i < words.size(); ++i)
      if (!read_limit(words, i, options)) options.arguments.push_back(words[i]);
    if (options.arguments.size() < 2)
      throw UsageError(
          "'pendula grade' needs tasks and submissions: pendula grade tasks.lua submissions --json");
    return options;
  }
  options.script = words[i];
  if (options.script.empty()) throw UsageError("the name of the script is empty");
  // pendula --safe script.lua --json: limits are also accepted after the script; "--" begins the arguments
  // of the script.
  ++i;
  if (options.safe)
    while (i < words.size() && read_limit(words, i, options)) ++i;
  if (options.safe && i < words.size() && words[i] == "--") ++i;
  take_rest(words, i, options.arguments);
  return options;
}

const char* help_text() {
  return R"(usage: pendula [options] [script.lua [arguments]]
       pendula test path...
       pendula grade tasks.lua submission-or-folder... [--json]
       pendula report script.lua [-o page.html]
       pendula manual [--luals]
       pendula kernel install
       pendula shard runs.db.d/17...
       pendula sweep status|cancel|collect|attach runs.db

Without a script: an interactive session, or, if standard input is not a terminal, the script that stands there.

  -e CODE       run CODE; several are run in order, before the script
  -i            go on with an interactive session behind -e and the script
  -             the script is standard input
  --safe        run the script confined: no processes, no network, no files but those of --folder
  --time 10s    with --safe: the most processor time (default 10s)
  --memory 1G   with --safe: the most memory (default 1G)
  --folder DIR  with --safe: the folder whose files can be read and written
  --json        with --safe: the outcome as JSON
  --no-color    no colour (also: the environment variable NO_COLOR)
  --version     print the version
  --licences    print the licences of the program and its libraries
  --help        print this text
  --            the next argument is the script, also if it begins with -

pendula test    runs scripted tests, files or all *.lua below a folder
pendula report  runs a script and writes its text, code, results and figures as one page: report --help
pendula manual  opens the manual; --luals writes the vocabulary for editors: manual --help
pendula kernel  makes the notebook kernel known to Jupyter: kernel --help

pendula grade   runs submissions confined and compares their answers with the tasks of a teacher's file;
                --time, --memory and --folder (read only) are for each submission

A script finds its arguments in the table arg and in ... . Exit status: 0, 1 after an error, 2 for a wrong
command line, 130 after Ctrl-C; with --safe also 3 forbidden call, 4 time, 5 memory, 6 too much output, 7 crash.
)";
}

}  // namespace pendula::shell
