// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"

#include "common/bundle/atomic_file.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace gyre {

namespace {

constexpr std::size_t key_length = 40;  // characters of Z85
using KeyText = std::array<char, key_length + 1>;

std::string text_of(const KeyText& text) {
  return {text.data(), key_length};
}

std::filesystem::path public_file(std::filesystem::path file) {
  return file += ".pub";
}

// The first line, without its end.
std::string first_line(const std::string& content) {
  return content.substr(0, content.find_first_of("\r\n"));
}

// A secret that the service manager hands over (systemd.exec(5), LoadCredential=): its folder is for this service
// alone, and the access list that makes it so shows up as rights of the group.
bool is_credential(const std::filesystem::path& file) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  return folder != nullptr && *folder == '/' && file.parent_path() == std::filesystem::path(folder);
}

tl::unexpected<Error> cannot_write(const std::filesystem::path& file) {
  return fail("cannot write the secret key", file.string() + " (" + std::strerror(errno) + ")");
}

}  // namespace

SecretKey::~SecretKey() {
  sodium_memzero(z85_.data(), z85_.size());
}

bool is_public_key(std::string_view text) {
  std::array<std::uint8_t, 32> bytes{};
  return text.size() == key_length && text.find('\0') == std::string_view::npos &&
         zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

KeyPair make_key_pair() {
  KeyText public_text{};
  KeyText secret_text{};
  zmq_curve_keypair(public_text.data(), secret_text.data());
  KeyPair keys{text_of(public_text), SecretKey(text_of(secret_text))};
  sodium_memzero(secret_text.data(), secret_text.size());
  return keys;
}

Result<void> write_key_pair(const std::filesystem::path& file, const KeyPair& keys) {
  if (file.has_parent_path()) {
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    if (error) return fail("cannot create the folder of the keys", file.parent_path().string());
  }
  // Not write_file: the secret must not exist with other permissions for a moment, nor replace one that devices rely
  // on.
  std::filesystem::path temporary = file;
  temporary += ".part" + std::to_string(::getpid());
  const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return cannot_write(file);
  const std::string line = keys.secret_key.reveal() + "\n";
  const bool written = ::write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size()) && ::fsync(fd) == 0;
  const bool linked = ::close(fd) == 0 && written && ::link(temporary.c_str(), file.c_str()) == 0;
  const auto error = cannot_write(file);
  ::unlink(temporary.c_str());
  if (!linked) return error;
  return write_public_key(public_file(file), keys.public_key);
}

Result<KeyPair> read_key_pair(const std::filesystem::path& file) {
  struct stat info {};
  if (!is_credential(file) && ::stat(file.c_str(), &info) == 0 && (info.st_mode & 077) != 0) {
    return fail("the secret key can be read by others", file.string(), "chmod 600 it, or make a new pair");
  }
  const Result<std::string> content = read_file(file);
  if (!content) return tl::unexpected(content.error());
  KeyPair keys{{}, SecretKey(first_line(*content))};
  KeyText public_text{};
  if (!is_public_key(keys.secret_key.reveal()) ||
      zmq_curve_public(public_text.data(), keys.secret_key.reveal().c_str()) != 0) {
    return fail("not a secret key", file.string(), "remove the file to get a new pair, then pair again");
  }
  keys.public_key = text_of(public_text);
  return keys;
}

Result<KeyPair> read_or_make_key_pair(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::exists(file, error) || error) return read_key_pair(file);
  KeyPair keys = make_key_pair();
  if (Result<void> written = write_key_pair(file, keys); !written) return tl::unexpected(written.error());
  return keys;
}

Result<void> write_public_key(const std::filesystem::path& file, const std::string& public_key) {
  if (!is_public_key(public_key)) return wrong_use("not a public key", public_key, "it is 40 characters of Z85");
  return write_file(file, public_key + "\n");
}

Result<std::string> read_public_key(const std::filesystem::path& file) {
  const Result<std::string> content = read_file(file);
  if (!content) return content;
  std::string key = first_line(*content);
  if (!is_public_key(key)) return fail("not a public key", file.string(), "pair again");
  return key;
}

}  // namespace gyre
