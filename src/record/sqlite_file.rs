//! Reads one SQLite file, as `ros2 bag record` of Humble writes by default.

use super::error::BagError;
use super::reader::{BagMessage, Block, Contents, Place, Topic};
use rusqlite::config::DbConfig;
use rusqlite::limits::Limit;
use rusqlite::{Connection, OpenFlags, Row};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows that are read at once.
const PAGE: usize = 500;

/// The longest message \[bytes\].
const MESSAGE_LIMIT: i32 = 128 * 1024 * 1024;

/// A SQLite file that has been looked through.
#[derive(Debug)]
pub(super) struct SqliteFile {
    path: PathBuf,
    connection: Connection,
    topics: HashMap<i64, (Arc<str>, Arc<str>)>,
    first: Option<Block>,
}

impl SqliteFile {
    /// Looks through the file, which is not changed.
    ///
    /// # Errors
    /// [`BagError::NotABag`], [`BagError::Damaged`].
    pub fn open(path: &Path) -> Result<Contents<Self>, BagError> {
        let connection = connect(path).map_err(|why| BagError::damaged(path, why.to_string()))?;
        let tables =
            "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')";
        let tables: i64 = connection
            .query_row(tables, [], |row| row.get(0))
            .map_err(|why| BagError::damaged(path, why.to_string()))?;
        if tables != 2 {
            return Err(BagError::not_a_bag(path, "it has no tables `topics` and `messages`"));
        }
        let mut file = Self { path: path.to_owned(), connection, topics: HashMap::new(), first: None };
        let topics = file.read_topics().map_err(|why| BagError::damaged(path, why.to_string()))?;
        file.first = file.read_start().map_err(|why| BagError::damaged(path, why.to_string()))?;
        Ok(Contents { file, topics, truncated: false })
    }

    /// Where its first messages are.
    pub fn first(&self) -> Option<Block> {
        self.first
    }

    /// Some messages after the one with that time and id, and where the next ones are.
    ///
    /// # Errors
    /// [`BagError::Damaged`].
    pub fn load(&self, time: i64, id: i64) -> Result<(Vec<BagMessage>, Option<Block>), BagError> {
        let page = self.read_page(time, id).map_err(|why| BagError::damaged(&self.path, why.to_string()))?;
        let mut before = (time, id);
        for row in &page {
            // A broken index could lead in circles.
            if (row.time, row.id) <= before {
                return Err(BagError::damaged(&self.path, "its messages are out of order"));
            }
            before = (row.time, row.id);
        }
        let next = (page.len() == PAGE)
            .then_some(Block { start: before.0, place: Place::Rows { time: before.0, id: before.1 } });
        Ok((page.into_iter().filter_map(|row| self.message(row)).collect(), next))
    }

    /// The message, unless its topic is not CDR.
    fn message(&self, row: MessageRow) -> Option<BagMessage> {
        let (topic, message) = self.topics.get(&row.topic)?;
        Some(BagMessage { topic: topic.clone(), message: message.clone(), log_time: row.time, cdr: row.cdr })
    }

    fn read_topics(&mut self) -> rusqlite::Result<Vec<Topic>> {
        let query = "SELECT topics.id, name, type, count(messages.id) FROM topics LEFT JOIN messages \
                     ON messages.topic_id = topics.id WHERE serialization_format = 'cdr' GROUP BY topics.id";
        let mut statement = self.connection.prepare(query)?;
        let mut rows = statement.query([])?;
        let mut topics = Vec::new();
        while let Some(row) = rows.next()? {
            let (name, message): (String, String) = (row.get(1)?, row.get(2)?);
            self.topics.insert(row.get(0)?, (name.as_str().into(), message.as_str().into()));
            topics.push(Topic { name, message, count: row.get::<_, i64>(3)?.unsigned_abs() });
        }
        Ok(topics)
    }

    fn read_start(&self) -> rusqlite::Result<Option<Block>> {
        let start: Option<i64> =
            self.connection.query_row("SELECT min(timestamp) FROM messages", [], |row| row.get(0))?;
        Ok(start.map(|start| Block { start, place: Place::Rows { time: i64::MIN, id: i64::MIN } }))
    }

    fn read_page(&self, time: i64, id: i64) -> rusqlite::Result<Vec<MessageRow>> {
        let query = "SELECT id, topic_id, timestamp, data FROM messages WHERE (timestamp, id) > (?1, ?2) \
                     ORDER BY timestamp, id LIMIT ?3";
        let mut statement = self.connection.prepare(query)?;
        let page = i64::try_from(PAGE).unwrap_or(i64::MAX);
        statement.query_map((time, id, page), MessageRow::read)?.collect()
    }
}

struct MessageRow {
    id: i64,
    topic: i64,
    time: i64,
    cdr: Vec<u8>,
}

impl MessageRow {
    fn read(row: &Row) -> rusqlite::Result<Self> {
        Ok(Self { id: row.get(0)?, topic: row.get(1)?, time: row.get(2)?, cdr: row.get(3)? })
    }
}

/// Opens the file read-only, without trust in what its schema makes SQLite do.
fn connect(path: &Path) -> rusqlite::Result<Connection> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let connection = Connection::open_with_flags(path, flags)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    connection.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MESSAGE_LIMIT)?;
    Ok(connection)
}
