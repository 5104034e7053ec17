// Runs the built program in a folder of its own and keeps what it said.

#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/core/temporary_folder.h"

extern char** environ;

namespace haarlight::fixtures {

using haarlight::read_bytes;
using haarlight::TemporaryFolder;
using haarlight::write_bytes;

/// What a run of the program came to.
struct ProgramResult {
  int code = -1;  ///< exit code; -1 when it was killed by a signal
  std::string out, err;
  long peak_kib = 0;  ///< most memory that it had resident
};

/// A started program; `command` is relative to `folder`, which is its working folder.
class Program {
 public:
  /// `starter`: words before the program's own, as of mpirun.
  Program(const std::vector<std::string>& arguments, const std::filesystem::path& folder,
          const std::vector<std::string>& starter = {},
          const std::string& program = HAARLIGHT_PROGRAM)
      : out_(folder / ".stdout"), err_(folder / ".stderr") {
    std::vector<std::string> words = starter;
    words.push_back(program);
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);

    // Threads that wait sleep rather than spin: tests run beside each other on few cores.
    ::setenv("OMP_WAIT_POLICY", "passive", 1);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out_.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err_.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0644);
    const int error = posix_spawn(&process_, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error("cannot start " + program);
  }

  bool running() {
    if (!ended_) ended_ = ::wait4(process_, &status_, WNOHANG, &usage_) == process_;
    return !ended_;
  }
  pid_t pid() const { return process_; }
  void interrupt() { ::kill(process_, SIGINT); }
  void kill() { ::kill(process_, SIGKILL); }

  ProgramResult wait() {
    while (!ended_) {
      ended_ = ::wait4(process_, &status_, 0, &usage_) == process_ || errno != EINTR;
    }
    return {WIFEXITED(status_) ? WEXITSTATUS(status_) : -1, read_bytes(out_), read_bytes(err_),
            usage_.ru_maxrss};
  }

 private:
  std::filesystem::path out_, err_;
  pid_t process_ = -1;
  int status_ = 0;
  rusage usage_{};
  bool ended_ = false;
};

inline ProgramResult run_program(const std::vector<std::string>& arguments,
                                 const std::filesystem::path& folder) {
  return Program(arguments, folder).wait();
}

}  // namespace haarlight::fixtures
