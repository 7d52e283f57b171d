// SPDX-License-Identifier: Apache-2.0
#include "offload/store/scan_archive.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"

#include <archive.h>
#include <archive_entry.h>
#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* manifest_name = "scan.archive.json";
constexpr std::string_view bundle_folder = "bundle/";
constexpr std::uint64_t max_manifest_bytes = 16 << 20;
constexpr std::size_t block_bytes = 1 << 16;

struct FreeReader {
  void operator()(archive* a) const { archive_read_free(a); }
};
struct FreeWriter {
  void operator()(archive* a) const { archive_write_free(a); }
};
struct FreeEntry {
  void operator()(archive_entry* e) const { archive_entry_free(e); }
};
using Reader = std::unique_ptr<archive, FreeReader>;
using Writer = std::unique_ptr<archive, FreeWriter>;
using Entry = std::unique_ptr<archive_entry, FreeEntry>;

std::string why(archive* a) {
  const char* text = archive_error_string(a);
  return text ? text : "unknown";
}

json to_json(const std::vector<StoredFile>& files) {
  json all = json::array();
  for (const StoredFile& file : files)
    all.push_back({{"name", file.name}, {"size", file.size}, {"sha256", file.sha256}});
  return all;
}

// A relative path without tricks.
bool is_safe_path(std::string_view path) {
  constexpr int deepest = 8;
  for (int depth = 0; depth < deepest; ++depth) {
    const std::size_t slash = path.find('/');
    if (!is_safe_name(path.substr(0, slash))) return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
  return false;
}

tl::unexpected<Error> not_a_scan(const fs::path& tar, const std::string& what) {
  return fail("the archive is not one of a scan", tar.string() + " (" + what + ")",
              "only archives of `gyre-offload store export` are taken");
}

Result<ArchivedScan> manifest_from(const std::string& text) {
  const json j = json::parse(text, nullptr, false);
  ArchivedScan archived;
  try {
    if (j.at("version").get<int>() != 1) return fail("written by another version");
    archived.scan.id = j.at("scan").get<std::string>();
    archived.scan.device_key = j.at("device_key").get<std::string>();
    archived.scan.device_name = j.at("device_name").get<std::string>();
    archived.scan.created = j.at("created").get<std::string>();
    archived.scan.phase = phase_named(j.at("phase").get<std::string>());
    archived.scan.reason = j.at("reason").get<std::string>();
    archived.scan.delivered = j.at("delivered").get<bool>();
    for (auto& [key, files] : {std::pair{"files", &archived.files}, std::pair{"results", &archived.results}}) {
      for (const json& file : j.at(key)) {
        files->push_back({file.at("name").get<std::string>(), file.at("size").get<std::uint64_t>(),
                          file.at("sha256").get<std::string>()});
        if (!is_safe_path(files->back().name)) return fail("a name leads elsewhere");
      }
    }
  } catch (const json::exception& e) {
    return fail("its manifest is damaged", e.what());
  }
  if (!is_ulid(archived.scan.id)) return fail("its scan has no id");
  return archived;
}

Result<void> add_bytes(archive* a, const fs::path& tar, const std::string& name, std::uint64_t size,
                       std::istream& content) {
  const Entry entry(archive_entry_new());
  constexpr mode_t mode = 0644;
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_size(entry.get(), static_cast<la_int64_t>(size));
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), mode);
  bool good = archive_write_header(a, entry.get()) == ARCHIVE_OK;
  std::array<char, block_bytes> block{};
  for (std::uint64_t left = size; good && left > 0;) {
    content.read(block.data(), static_cast<std::streamsize>(std::min<std::uint64_t>(left, block.size())));
    const auto got = static_cast<std::size_t>(content.gcount());
    if (got == 0) return fail("a file changed while it was exported", name);
    good = archive_write_data(a, block.data(), got) == static_cast<la_ssize_t>(got);
    left -= got;
  }
  if (good) return {};
  return fail("cannot write the archive", tar.string() + " (" + why(a) + ")", "check the space and rights there");
}

// The files of a bundle, relative to it, without hidden ones.
Result<std::vector<std::string>> files_of(const Bundle& bundle) {
  std::vector<std::string> names;
  std::error_code error;
  auto it = fs::recursive_directory_iterator(bundle.root(), error);
  for (; !error && it != fs::recursive_directory_iterator(); it.increment(error)) {
    const bool hidden = it->path().filename().string().starts_with('.');
    if (hidden && it->is_directory(error)) it.disable_recursion_pending();
    if (hidden || it->is_symlink(error) || !it->is_regular_file(error)) continue;
    names.push_back(it->path().lexically_relative(bundle.root()).generic_string());
    if (!is_safe_path(names.back()))
      return fail("a file of the scan has a name that no archive takes", it->path().string());
  }
  if (error) return fail("cannot list", bundle.root().string() + " (" + error.message() + ")");
  std::sort(names.begin(), names.end());
  return names;
}

// Unpacks one tar.
class Unpacking {
 public:
  Unpacking(const fs::path& tar, fs::path into, const ArchiveLimits& limits)
      : tar_(tar), into_(std::move(into)), limits_(limits), reader_(archive_read_new()) {}

  Result<ArchivedScan> run() {
    archive_read_support_format_tar(reader_.get());
    if (archive_read_open_filename(reader_.get(), tar_.c_str(), block_bytes) != ARCHIVE_OK)
      return fail("cannot read the archive", tar_.string() + " (" + why(reader_.get()) + ")");
    Result<ArchivedScan> archived = read_manifest();
    if (!archived) return archived;
    const std::string prefix = archived->scan.id + "/" + std::string(bundle_folder);
    while (true) {
      archive_entry* entry = nullptr;
      const int code = archive_read_next_header(reader_.get(), &entry);
      if (code == ARCHIVE_EOF) break;
      if (code != ARCHIVE_OK) return not_a_scan(tar_, why(reader_.get()));
      const Result<std::string> name = name_of_file(entry, prefix);
      if (!name) return tl::unexpected(name.error());
      if (Result<void> done = write_entry(*name); !done) return tl::unexpected(done.error());
    }
    if (Result<void> good = check_hashes(*archived); !good) return tl::unexpected(good.error());
    return archived;
  }

 private:
  Result<ArchivedScan> read_manifest() {
    archive_entry* entry = nullptr;
    if (archive_read_next_header(reader_.get(), &entry) != ARCHIVE_OK) return not_a_scan(tar_, why(reader_.get()));
    const char* path = archive_entry_pathname(entry);
    const std::string name = path ? path : "";
    std::string text;
    std::array<char, block_bytes> block{};
    for (la_ssize_t got = 1; got > 0;) {
      got = archive_read_data(reader_.get(), block.data(), block.size());
      if (got < 0) return not_a_scan(tar_, why(reader_.get()));
      text.append(block.data(), static_cast<std::size_t>(got));
      if (text.size() > max_manifest_bytes) return not_a_scan(tar_, "its manifest is too large");
    }
    Result<ArchivedScan> archived = manifest_from(text);
    if (!archived) return not_a_scan(tar_, archived.error().message());
    if (name != archived->scan.id + "/" + manifest_name) return not_a_scan(tar_, "it does not begin with a manifest");
    return archived;
  }

  Result<std::string> name_of_file(archive_entry* entry, const std::string& prefix) {
    const char* path = archive_entry_pathname(entry);
    const std::string full = path ? path : "";
    if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry) || archive_entry_symlink(entry))
      return not_a_scan(tar_, "it holds something that is not a file: " + full);
    if (!full.starts_with(prefix)) return not_a_scan(tar_, "a name leads elsewhere: " + full);
    std::string name = full.substr(prefix.size());
    if (!is_safe_path(name)) return not_a_scan(tar_, "a name leads elsewhere: " + full);
    if (++files_ > limits_.max_files) return not_a_scan(tar_, "it holds too many files");
    return name;
  }

  Result<void> write_entry(const std::string& name) {
    const fs::path file = into_ / name;
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    if (error || fs::exists(file, error)) return not_a_scan(tar_, "a file is there twice: " + name);
    std::ofstream out(file, std::ios::binary);
    std::array<char, block_bytes> block{};
    while (out) {
      const la_ssize_t got = archive_read_data(reader_.get(), block.data(), block.size());
      if (got < 0) return not_a_scan(tar_, why(reader_.get()));
      if (got == 0) break;
      bytes_ += static_cast<std::uint64_t>(got);
      if (bytes_ > limits_.max_bytes) return not_a_scan(tar_, "it is larger than the limit");
      out.write(block.data(), got);
    }
    out.close();
    if (!out) return fail("cannot write", file.string(), "free some disk space and try again");
    return sync_path(file);
  }

  Result<void> check_hashes(const ArchivedScan& archived) const {
    for (const auto* files : {&archived.files, &archived.results}) {
      for (const StoredFile& file : *files) {
        const Result<std::string> hash = sha256_of_file(into_ / file.name);
        if (!hash || *hash != file.sha256) return not_a_scan(tar_, "missing or damaged: " + file.name);
      }
    }
    return {};
  }

  const fs::path& tar_;
  fs::path into_;
  const ArchiveLimits& limits_;
  Reader reader_;
  std::uint64_t bytes_ = 0;
  std::size_t files_ = 0;
};

}  // namespace

Result<void> pack_scan(const ArchivedScan& archived, const Bundle& bundle, const fs::path& tar) {
  const json manifest = {{"version", 1},
                         {"scan", archived.scan.id},
                         {"device_key", archived.scan.device_key},
                         {"device_name", archived.scan.device_name},
                         {"created", archived.scan.created},
                         {"phase", name_of(archived.scan.phase)},
                         {"reason", archived.scan.reason},
                         {"delivered", archived.scan.delivered},
                         {"files", to_json(archived.files)},
                         {"results", to_json(archived.results)}};
  const Result<std::vector<std::string>> names = files_of(bundle);
  if (!names) return tl::unexpected(names.error());
  fs::path part = tar;
  part += ".part";
  const Writer writer(archive_write_new());
  archive_write_set_format_pax_restricted(writer.get());
  const auto write_all = [&]() -> Result<void> {
    if (archive_write_open_filename(writer.get(), part.c_str()) != ARCHIVE_OK)
      return fail("cannot write the archive", part.string() + " (" + why(writer.get()) + ")");
    std::istringstream text(manifest.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
    const std::string folder = archived.scan.id + "/";
    if (Result<void> done = add_bytes(writer.get(), part, folder + manifest_name, text.view().size(), text); !done)
      return done;
    for (const std::string& name : *names) {
      std::error_code error;
      const std::uintmax_t size = fs::file_size(bundle.root() / name, error);
      std::ifstream content(bundle.root() / name, std::ios::binary);
      if (error || !content) return fail("cannot read", (bundle.root() / name).string());
      const Result<void> added =
          add_bytes(writer.get(), part, folder + std::string(bundle_folder) + name, size, content);
      if (!added) return added;
    }
    if (archive_write_close(writer.get()) != ARCHIVE_OK)
      return fail("cannot write the archive", part.string() + " (" + why(writer.get()) + ")");
    if (Result<void> synced = sync_path(part); !synced) return synced;
    return rename_durably(part, tar);
  };
  Result<void> done = write_all();
  std::error_code error;
  if (!done) fs::remove(part, error);
  return done;
}

Result<ArchivedScan> unpack_scan(const fs::path& tar, const fs::path& into, const ArchiveLimits& limits) {
  return Unpacking(tar, into, limits).run();
}

}  // namespace gyre
