#include "client/app/script_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "client/app/ctl_commands.h"

namespace strandcast {
namespace {

/// Where it lies, or its name alone where the shell's search is to find it.
std::string find_script(const std::string& name) {
  std::error_code failure;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failure).parent_path();
  for (const std::filesystem::path& folder : {own, own / "../lib/strandcast"})
    if (!failure && std::filesystem::exists(folder / name, failure)) return (folder / name).string();
  return name;
}

}  // namespace

int run_script(const std::string& name, const std::vector<std::string>& words) {
  std::string script = find_script(name);
  std::vector<std::string> own = words;
  std::vector<char*> arguments{script.data()};
  for (std::string& word : own) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  execvp(script.c_str(), arguments.data());
  fmt::print(stderr,
             "strandcast-ctl: {} cannot be started ({}): it comes with this program and needs Python 3\n",
             name, std::strerror(errno));
  return kBadInputExit;
}

}  // namespace strandcast
