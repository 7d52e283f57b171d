// SPDX-License-Identifier: Apache-2.0
#include "tests/system/platter.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>
#include <vector>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// Tells a file or folder from all others there ever were: numbers of inodes come again, with another time of birth.
// Empty: it is gone.
std::string key_of(const fs::path& path) {
  struct statx status {};
  if (::statx(AT_FDCWD, path.c_str(), AT_SYMLINK_NOFOLLOW, STATX_INO | STATX_BTIME, &status) != 0) return {};
  return std::to_string(status.stx_ino) + "-" + std::to_string(status.stx_btime.tv_sec) + "-" +
         std::to_string(status.stx_btime.tv_nsec);
}

struct Name {
  std::string key, name;
};

std::vector<Name> names_in(const fs::path& folder) {
  std::vector<Name> names;
  std::error_code error;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string key = key_of(it->path());
    if (!key.empty()) names.push_back({key, it->path().filename().string()});
  }
  return names;
}

std::optional<std::string> content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream all;
  all << in.rdbuf();
  return all.str();
}

bool write(const fs::path& file, const std::string& content) {
  std::ofstream out(file, std::ios::binary);
  out << content << std::flush;
  return bool(out);
}

// Whole or not at all, also when this process is killed in the middle.
bool replace(const fs::path& file, const std::string& content) {
  const fs::path temporary = file.string() + ".new";
  if (!write(temporary, content)) return false;
  std::error_code error;
  fs::rename(temporary, file, error);
  return !error;
}

bool comes_up(std::mt19937& random) {
  return random() % 2 == 0;
}

}  // namespace

// What is there just before the cut.
struct Platter::Live {
  std::map<std::string, fs::path> paths;  // by key

  explicit Live(const fs::path& root) {
    paths[key_of(root)] = root;
    std::error_code error;
    for (auto it = fs::recursive_directory_iterator(root, error); !error && it != fs::recursive_directory_iterator();
         it.increment(error)) {
      paths[key_of(it->path())] = it->path();
    }
  }
  std::optional<fs::path> find(const std::string& key) const {
    const auto found = paths.find(key);
    return found == paths.end() ? std::nullopt : std::optional(found->second);
  }
};

Platter::Platter(fs::path folder, fs::path root) : folder_(fs::canonical(folder)), root_(fs::canonical(root)) {}

bool Platter::keep(const fs::path& path) const {
  const std::string key = key_of(path);
  if (key.empty()) return true;
  if (!fs::is_directory(path)) {
    const std::optional<std::string> content = content_of(path);
    return content && replace(folder_ / (key + ".bytes"), *content);
  }
  std::string listing;
  for (const Name& name : names_in(path)) listing += name.key + " " + name.name + "\n";
  return replace(folder_ / (key + ".names"), listing);
}

bool Platter::sync(int fd) const {
  std::error_code error;
  const fs::path link = "/proc/self/fd/" + std::to_string(fd);
  const fs::path path = fs::read_symlink(link, error);
  if (error) return false;
  const std::string inside = root_.string() + "/";
  if (path != root_ && path.string().rfind(inside, 0) != 0) return true;
  return keep(path);
}

void Platter::sync_all() const {
  std::error_code ignored;
  for (const auto& old : fs::directory_iterator(folder_)) fs::remove(old.path(), ignored);
  keep(root_);
  for (const auto& entry : fs::recursive_directory_iterator(root_)) keep(entry.path());
}

// Of a file, by chance.
std::string Platter::bytes(const std::string& key, const Live& live, std::mt19937* random) const {
  const std::optional<std::string> synced = content_of(folder_ / (key + ".bytes"));
  const std::optional<fs::path> path = live.find(key);
  if (random == nullptr || !path) return synced.value_or("");
  std::string now = content_of(*path).value_or("");
  const std::string before = synced.value_or("");
  // What was synced stays when there was only something added to it.
  const std::size_t sure = now.compare(0, before.size(), before) == 0 ? before.size() : 0;
  if (sure == 0 && !before.empty() && comes_up(*random)) return before;
  const std::size_t whole = now.size();
  now.resize(sure + (*random)() % (whole - sure + 1));
  if (comes_up(*random)) now.resize(whole);
  return now;
}

void Platter::build(const std::string& key, const fs::path& to, const Live& live, std::mt19937* random) const {
  fs::create_directories(to);
  const std::optional<fs::path> path = live.find(key);
  std::vector<Name> names;
  if (random != nullptr && path && comes_up(*random)) {
    names = names_in(*path);
  } else {
    std::istringstream listing(content_of(folder_ / (key + ".names")).value_or(""));
    for (Name name; listing >> name.key && std::getline(listing.ignore(), name.name);) names.push_back(name);
  }
  for (const Name& name : names) {
    const std::optional<fs::path> there = live.find(name.key);
    if (fs::exists(folder_ / (name.key + ".names")) || (there && fs::is_directory(*there))) {
      build(name.key, to / name.name, live, random);
      continue;
    }
    write(to / name.name, bytes(name.key, live, random));
    if (there) fs::permissions(to / name.name, fs::status(*there).permissions());
  }
}

void Platter::cut(std::mt19937* random) const {
  const Live live(root_);
  const fs::path after = root_.string() + ".after";
  build(key_of(root_), after, live, random);
  fs::remove_all(root_);
  fs::rename(after, root_);
  sync_all();
}

}  // namespace gyre
