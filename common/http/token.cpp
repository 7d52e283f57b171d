// SPDX-License-Identifier: Apache-2.0
#include "common/http/token.h"

#include "common/bundle/atomic_file.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <cstring>

namespace gyre {

namespace {

constexpr std::size_t token_bytes = 20;

Result<std::string> read_token(const std::filesystem::path& file) {
  struct stat facts {};
  if (::stat(file.c_str(), &facts) != 0) return fail("cannot read the token", file.string());
  if ((facts.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return fail("others may read the token", file.string(), "run chmod 600 on it, or remove it to get a new one");
  }
  Result<std::string> text = read_file(file);
  if (!text) return text;
  const std::string token = text->substr(0, text->find_first_of("\r\n"));
  if (token.size() < 2 * token_bytes) return fail("there is no token in the file", file.string(), "remove it");
  return token;
}

Result<void> write_token(const std::filesystem::path& file, const std::string& token) {
  // Not write_file: it must not exist with other permissions for a moment.
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) return fail("cannot write the token", file.string() + " (" + std::strerror(errno) + ")");
  const std::string line = token + "\n";
  const bool written = ::write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  ::close(fd);
  if (!written) return fail("cannot write the token", file.string(), "free some space");
  return {};
}

}  // namespace

std::string new_token() {
  std::array<unsigned char, token_bytes> bytes{};
  ::randombytes_buf(bytes.data(), bytes.size());
  std::array<char, 2 * token_bytes + 1> text{};
  ::sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  return text.data();
}

Result<std::string> read_or_make_token(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::exists(file, error)) return read_token(file);
  const std::string token = new_token();
  if (const Result<void> written = write_token(file, token); !written) return tl::unexpected(written.error());
  return token;
}

}  // namespace gyre
