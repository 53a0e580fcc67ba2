//! Runs the search for another configuration on its own thread, so that the cycle does not wait.

use super::events::EventsRecord;
use dq_core::servo::{Arms, Event, Servo};
use dq_search::{STARTS, Search};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// The longest time of one search, so that the search leaves the processors to other tasks.
const BUDGET: Duration = Duration::from_millis(20);

/// Sends searches from the cycle to the thread that runs them, and takes back their results. There is one [`Search`], which the cycle
/// and the thread pass back and forth, so that the cycle allocates nothing.
pub(super) struct Searcher {
    here: Option<Box<Search>>,
    questions: SyncSender<Box<Search>>,
    answers: Receiver<Box<Search>>,
}

impl Searcher {
    /// Starts the thread for a servo of these arms.
    ///
    /// # Errors
    /// The operating system's error if it creates no thread.
    pub fn spawn(arms: Arms) -> std::io::Result<Self> {
        let (questions, asked) = sync_channel::<Box<Search>>(1);
        let (done, answers) = sync_channel(1);
        let search = move || {
            for mut search in asked {
                let end = Instant::now() + BUDGET;
                search.run(STARTS, || Instant::now() < end);
                if done.send(search).is_err() {
                    break;
                }
            }
        };
        std::thread::Builder::new().name("search".to_owned()).spawn(search)?;
        Ok(Self { here: Some(Box::new(Search::new(arms))), questions, answers })
    }

    /// Gives the servo the result of a finished search, and starts the next search if the servo asks for one.
    pub fn feed(&mut self, servo: &mut Servo, record: &mut EventsRecord) {
        if let Ok(search) = self.answers.try_recv() {
            let _ = record.take(servo, Event::Found(search.found()));
            self.here = Some(search);
        }
        if let Some(search) = self.here.take_if(|search| servo.ask(search)) {
            // Sending cannot block: there is only one search, and the channel holds one. If the thread has ended, the servo detects
            // that no answer comes.
            let _ = self.questions.try_send(search);
        }
    }
}
