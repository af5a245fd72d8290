#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

// Runs the program itself, as a user would, in a folder of the test's own.
namespace medulla {

struct ProgramResult {
  int exitCode = -1;
  std::string out, err;
};

// What it says is wrong, one per line: a slow machine has told how far it was before that.
inline std::vector<std::string> complaints(const ProgramResult& r) {
  std::vector<std::string> out;
  std::istringstream lines(r.err);
  for (std::string line; std::getline(lines, line);)
    if (!line.ends_with(" s left")) out.push_back(line);
  return out;
}

// Of a line "name value [unit]": what stands after the name; nothing where there is no such line.
inline std::string valueOf(const std::string& out, const std::string& name) {
  const std::size_t at = ("\n" + out).find("\n" + name + " ");
  if (at == std::string::npos) return {};
  const std::size_t start = at + name.size() + 1;
  return out.substr(start, out.find('\n', start) - start);
}

inline void expectRefusal(const ProgramResult& r, int exitCode, const std::vector<std::string>& words) {
  EXPECT_EQ(r.exitCode, exitCode) << r.err;
  EXPECT_EQ(r.out, "");
  EXPECT_EQ(complaints(r).size(), 1) << r.err;
  for (const std::string& word : words)
    EXPECT_NE(r.err.find(word), std::string::npos) << "no \"" << word << "\" in " << r.err;
}

struct ProgramOptions {
  std::string folder = ".";
  std::function<bool()> interruptWhen;  // asked every 10 ms; `signal` is sent once it holds
  int signal = SIGINT;
  std::string path;                                              // PATH of the child; empty: inherited
  std::string output;                                            // where its standard output goes; empty: result.out
  std::vector<std::pair<std::string, std::string>> environment;  // set for the child
  long fileSizeLimit = 0;  // bytes; a longer file fails as on a full disk; 0: none
};

inline std::string readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline ProgramResult runProgram(const std::vector<std::string>& arguments, const ProgramOptions& options = {}) {
  char base[] = "/tmp/medulla_run_XXXXXX";
  const std::string folder = mkdtemp(base);
  const pid_t child = fork();
  if (child == 0) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, SIG_DFL);  // nohup would have them ignored
    const std::string output = options.output.empty() ? folder + "/out" : options.output;
    if (!freopen(output.c_str(), "w", stdout) || !freopen((folder + "/err").c_str(), "w", stderr) ||
        chdir(options.folder.c_str()) != 0)
      _exit(99);
    if (!options.path.empty()) setenv("PATH", options.path.c_str(), 1);
    for (const auto& [name, value] : options.environment) setenv(name.c_str(), value.c_str(), 1);
    if (options.fileSizeLimit > 0) {
      const rlimit limit{static_cast<rlim_t>(options.fileSizeLimit), static_cast<rlim_t>(options.fileSizeLimit)};
      setrlimit(RLIMIT_FSIZE, &limit);
    }
    std::vector<char*> argv{const_cast<char*>(MEDULLA_PROGRAM)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execv(MEDULLA_PROGRAM, argv.data());
    _exit(98);
  }
  int status = 0;
  bool ended = false;
  if (options.interruptWhen) {
    while (!(ended = waitpid(child, &status, WNOHANG) == child) && !options.interruptWhen()) usleep(10000);
    if (!ended) kill(child, options.signal);
  }
  if (!ended) waitpid(child, &status, 0);
  ProgramResult result;
  result.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.out = readFile(folder + "/out");
  result.err = readFile(folder + "/err");
  std::filesystem::remove_all(folder);
  return result;
}

}  // namespace medulla
