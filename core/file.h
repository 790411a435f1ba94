// Files are read whole and written whole: under a temporary name, fsync, rename. A reader never sees half a
// file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace limber {

namespace fs = std::filesystem;

// Readers hold what they read in memory: what is larger than this is nothing that any of them is meant for.
inline constexpr std::uintmax_t max_bytes_read = std::uintmax_t(8) << 30;

// Throws InputError when there is no such file, when it cannot be read, is larger than `max_bytes`, or is
// a pipe or a device: they could keep the reader waiting or never end.
std::string read_file(const fs::path&, std::uintmax_t max_bytes = max_bytes_read);

// Such a file, read piece by piece: it may be larger than memory. Throws as read_file().
inline constexpr std::uintmax_t max_bytes_by_pieces = std::uintmax_t(1) << 40;
class FileReader {
 public:
  explicit FileReader(const fs::path&, std::uintmax_t max_bytes = max_bytes_by_pieces);
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;
  std::uintmax_t size() const { return size_; }
  std::size_t read(std::span<char> to);  // how much came; 0: the end
  int release();                         // the descriptor, for a library that reads by itself and closes it

 private:
  fs::path path_;
  int descriptor_;
  std::uintmax_t size_;
};

// Throws DiskError (nothing is left behind) when the disk is full, the folder is missing or not writable.
void write_file(const fs::path&, std::string_view content);

// For a program that writes the file itself (ffmpeg): it writes to temporary(), then commit() makes it final.
class PendingFile {
 public:
  explicit PendingFile(fs::path final_path);
  ~PendingFile();  // removes what was not committed
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;
  const fs::path& temporary() const { return temporary_; }  // in the same folder, same extension
  void commit();                                            // fsync, rename; throws DiskError

 private:
  fs::path final_, temporary_;
  bool committed_ = false;
};

// A file too large to be held whole: written piece by piece, and nothing of it is seen before commit(). Both
// throw DiskError.
class FileWriter {
 public:
  explicit FileWriter(const fs::path&);
  ~FileWriter();
  FileWriter(const FileWriter&) = delete;
  FileWriter& operator=(const FileWriter&) = delete;
  void append(std::string_view);
  void write_at(std::uintmax_t place, std::string_view);  // over what is there, and on
  void commit();
  std::uintmax_t size() const { return size_; }  // bytes so far

 private:
  fs::path path_;
  PendingFile pending_;
  int descriptor_;
  std::uintmax_t size_ = 0;
};

// Makes the folder and its parents; throws DiskError naming the one that failed, also when it is a file or
// not writable.
void make_folder(const fs::path&);

}  // namespace limber
