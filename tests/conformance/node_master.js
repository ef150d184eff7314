/**
 * node-canopen as a master. Frames and orders come in on stdin, frames, answers and events go out on stdout, a line of
 * JSON each: {"frame": [id, "hex"]}, {"order": "upload", ...}, {"answer": ...}, {"refused": "..."}, {"event": "..."}.
 *
 * Arguments: the EDS of node 1, its $NODEID worked out, for node-canopen does not know it.
 */
'use strict';

const Module = require('node:module');
const readline = require('node:readline');
const { crc16xmodem } = require('crc');

// node-canopen has its check sum from a native addon that needs a compiler; another package's does without
const load = Module._load;
Module._load = (name, ...rest) => (name === 'node-crc' ? { crc: checkSum } : load(name, ...rest));

function checkSum(...parameters) {
    const sum = Buffer.alloc(2);
    sum.writeUInt16BE(crc16xmodem(parameters.at(-1)));
    return sum;
}

const { Device, Eds, NmtState } = require('canopen');

const PATIENCE_MS = 20000;
const NODE = 1;

function write(line) {
    process.stdout.write(JSON.stringify(line) + '\n');
}

function buildMaster(edsFile) {
    const eds = new Eds();
    eds.setSyncCobId(0x80);
    eds.setSyncGenerationEnable(true);
    const master = new Device({ id: 127, eds });
    const drive = Eds.fromFile(edsFile);
    master.mapRemoteNode({ id: NODE, eds: drive });
    master.on('message', ({ id, data }) => write({ frame: [id, data.toString('hex')] }));
    master.nmt.on('heartbeat', ({ deviceId, state }) => write({ event: 'heartbeat', node: deviceId, state }));
    master.emcy.on('emergency', ({ cobId, em }) => {
        write({ event: 'emergency', cobId, code: em.code, register: em.register });
    });
    master.pdo.on('pdo', ({ cobId, dataObjects }) => {
        const values = Object.fromEntries(dataObjects.map((entry) => [entry.parameterName, entry.value]));
        write({ event: 'pdo', cobId, values });
    });
    master.start();
    master.nmt.setState(NmtState.OPERATIONAL); // its own: what is not operational hears no PDO
    return master;
}

let master = null;

const transfer = ({ index, subIndex, block }) => (
    { deviceId: NODE, index, subIndex, blockTransfer: block, timeout: PATIENCE_MS }
);
const orders = {
    begin: () => {
        master?.removeAllListeners();
        master?.stop();
        master = buildMaster(process.argv[2]);
    },
    upload: async (order) => (await master.sdo.upload(transfer(order))).toString('hex'),
    download: async (order) => {
        await master.sdo.download({ ...transfer(order), data: Buffer.from(order.data, 'hex') });
    },
    nmt: ({ service }) => master.nmt[service](NODE),
    sync: ({ counter }) => master.sync.write(counter),
    frame: ({ id, data }) => master.pdo.send(id, Buffer.from(data, 'hex')),
};

async function obey(order) {
    try {
        write({ answer: (await orders[order.order](order)) ?? null });
    } catch (error) {
        write({ refused: typeof error === 'number' ? error : error.code ?? String(error) });
    }
}

readline.createInterface({ input: process.stdin }).on('line', (line) => {
    const said = JSON.parse(line);
    if (said.frame) {
        master?.receive({ id: said.frame[0], data: Buffer.from(said.frame[1], 'hex') });
    } else {
        obey(said);
    }
}).on('close', () => process.exit());
