// pendula grade: submissions against a teacher's tasks.
//
// A submission runs confined and hands out its answers as text; another confined process, which has never
// run a line of it, reads them as data beside the teacher's file and says what is right. One crash or
// endless loop costs one submission.
#pragma once

#include <string>
#include <vector>

#include "shell/sandbox/sandbox.hpp"

namespace pendula::shell::grading {

struct Request {
  std::string tasks;                     ///< the teacher's file; its folder can be read by it
  std::vector<std::string> submissions;  ///< files, or folders of *.lua
  sandbox::Limits limits;                ///< of a submission; folder: data that it may read
  bool json = false;
  int jobs = 0;  ///< submissions at a time; 0: one per processor
};

struct Verdict {
  std::string task, verdict;  ///< "right", "equivalent", "partly", "wrong", "missing", "error", "not graded"
  double points = 0, of = 0;
  int line = 0;  ///< where the answer was given; 0: nowhere
  std::string feedback;
};

struct Graded {
  std::string submission;
  sandbox::Outcome outcome;  ///< of running the submission
  std::vector<Verdict> verdicts;
  double points() const;
};

struct Report {
  std::string title;
  double of = 0;
  std::vector<Graded> submissions;  ///< sorted by name
};

/// Throws Error for tasks or files that cannot be read, and where no process can be confined.
Report grade(const Request& request);

/// The same bytes for the same submissions, whatever the number of jobs: no times, no addresses.
std::string json_report(const Report& report);
std::string text_report(const Report& report);

}  // namespace pendula::shell::grading
